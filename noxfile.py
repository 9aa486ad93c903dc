#!/usr/bin/env -S uv run --script
# /// script
# dependencies = ["nox>=2025.2.9"]
# ///
"""Tasks of developers: `nox -s tests` runs one of them, `nox` the checks and the tests, each in its own environment."""

import nox

nox.needs_version = ">=2025.2.9"
nox.options.default_venv_backend = "uv|virtualenv"

PYTHONS = ["3.11", "3.12", "3.13", "3.14"]
# Tests of figures, files and the command that need only the packages that warpdyn imports.
LOWEST = [f"tests/test_{name}.py" for name in ("animations", "plots", "command_line", "scene_json")]


@nox.session
def lint(session: nox.Session) -> None:
    """Check style, types and spelling."""
    session.install("-e", ".[test]", "codespell>=2.3")
    session.run("ruff", "check", ".")
    session.run("ruff", "format", "--check", ".")
    session.run("mypy")
    session.run("codespell")


@nox.session(python=PYTHONS)
def tests(session: nox.Session) -> None:
    """Run the tests; arguments after `--` are those of pytest."""
    session.install(".[test]")
    session.run("warpdyn", "self-test")
    session.run("pytest", *session.posargs)


@nox.session(python="3.11", venv_backend="uv", default=False)
def lowest(session: nox.Session) -> None:
    """Test the oldest versions of the packages that warpdyn imports."""
    session.install("--resolution", "lowest-direct", ".", "pytest>=8", "hypothesis>=6.100")
    session.run("warpdyn", "self-test")
    # Old packages warn about new ones; the other tests need further packages.
    session.run("pytest", "-o", "addopts=", "-o", "filterwarnings=ignore", "-m", "fast", *LOWEST)


@nox.session(default=False)
def docs(session: nox.Session) -> None:
    """Build the site in results/site."""
    session.install(".[docs]")
    session.run("sphinx-build", "-W", "--keep-going", "-q", "docs", "results/site")
    session.run("python", "docs/check_links.py", "results/site")


@nox.session(default=False)
def build(session: nox.Session) -> None:
    """Build the wheel and the source distribution in dist/."""
    session.install("build>=1.2")
    session.run("python", "-m", "build")


if __name__ == "__main__":
    nox.main()
