"""How Sphinx builds the site: `sphinx-build -W -n docs results/site` with the extra "docs"."""

from __future__ import annotations

import gc
import hashlib
import importlib
import os
import re
import sys
import tempfile
import tomllib
from pathlib import Path
from types import ModuleType

from docutils import nodes
from sphinx.application import Sphinx

import warpdyn as wd

DOCS = Path(__file__).parent
# Pages are trees of objects that stay: they are searched for cycles less often.
gc.set_threshold(50_000, 20, 50)
sys.path[:0] = [str(DOCS), str(DOCS.parent / "tests")]

# Sphinx imports objects by the names that users write, such as `warpdyn.laws`; the packages are inside of layers.
for name in wd.__all__:
    if isinstance(public := getattr(wd, name), ModuleType):
        sys.modules[f"warpdyn.{name}"] = public

project = "warpdyn"
author = "the warpdyn developers"
copyright = author
release = version = wd.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "sphinx_design",
    "generate.accessible",
    "generate.equations",
    "generate.front.thumbnails",
]
html_math_renderer = "mathml"  # of generate.equations: pages show equations without a network
templates_path = ["_templates"]
# The second are parts of other pages, the third is offered for download and installs a wheel.
exclude_patterns = ["README.md", "**/generated/_*.md", "tutorials/hosted_gpu.ipynb"]
suppress_warnings = ["mystnb.unknown_mime_type"]  # a progress bar has no picture in a printed page

# Pages
myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "fieldlist", "substitution"]
URLS = tomllib.loads((DOCS.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"].get("urls", {})
REPOSITORY = next((url for name, url in URLS.items() if name.lower() in ("repository", "source", "code")), None)
ADDRESS = f"  url     = {{{REPOSITORY}}},\n" if REPOSITORY else ""
BIBTEX = f"""```bibtex
@software{{warpdyn,
  author  = {{{{The warpdyn developers}}}},
  title   = {{warpdyn: ensembles of structural dynamics on GPUs and CPUs}},
  version = {{{version}}},
  year    = {{2026}},
{ADDRESS}}}
```"""
myst_substitutions = {
    "version": version,
    "repository": f"[Repository]({REPOSITORY}) · " if REPOSITORY else "",
    "bibtex": BIBTEX,
}
myst_heading_anchors = 3

# Programs in pages show their pyplot figures, as in a notebook, for any matplotlib backend of this process.
os.environ["MPLBACKEND"] = "module://matplotlib_inline.backend_inline"

# Programs in pages run when the site is built, and one that fails stops the build.
# Each program runs in a separate process. 50 % of its time is spent in imports, and a third of that in Python's search
# for reference cycles.
notebooks = tempfile.TemporaryDirectory()
(startup := Path(notebooks.name, "profile_default", "startup")).mkdir(parents=True)
(startup / "fewer_searches.py").write_text(
    "import atexit, gc; gc.set_threshold(50_000, 20, 50); atexit.register(gc.freeze)"
)
os.environ["IPYTHONDIR"] = notebooks.name
nb_execution_mode = "cache"
nb_execution_in_temp = True  # what they write is not left among the pages
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_execution_show_tb = True
nb_merge_streams = True
nb_render_image_options = {"align": "center"}

# Reference
autosummary_generate = True
autosummary_imported_members = True
# Pages of classes have the methods that users call, which tests hold to be documented, and these properties.
METHODS = importlib.import_module("public_names").METHODS
PROPERTIES = {"GroundMotion": ["duration", "peak_ground_acceleration"], "ShearBuilding": ["fundamental_period"]}
members = {name: METHODS.get(name, []) + PROPERTIES.get(name, []) for name in METHODS.keys() | PROPERTIES.keys()}
autosummary_context = {"members_of_users": {f"warpdyn.{name}": each for name, each in members.items()}}
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
autodoc_class_signature = "mixed"
autodoc_preserve_defaults = True
maximum_signature_line_length = 88  # longer ones have a line for each argument
# Types that signatures would show in full, over several lines.
autodoc_type_aliases = {"ArrayLike": "ArrayLike"}
python_use_unqualified_type_names = True
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_rtype = False
# Words between single backticks in docstrings become links where they name something public, and code elsewhere.
default_role = "py:obj"

# Look
html_theme = "pydata_sphinx_theme"
html_title = "warpdyn"
html_static_path = ["_static"]
html_favicon = "_static/favicon.svg"
html_css_files = ["site.css"]
html_js_files = ["site.js"]
html_show_sourcelink = False
html_copy_source = False
SINGLE = ("getting_started", "gallery", "comparison", "faq", "release_notes", "citation", "licence")
html_sidebars = {page: [] for page in SINGLE}
html_theme_options = {
    "show_prev_next": True,
    "navigation_with_keys": False,
    "show_toc_level": 2,
    "header_links_before_dropdown": 6,
    "navbar_align": "left",
    "icon_links": [{"name": "Repository", "url": REPOSITORY, "icon": "fa-solid fa-code-branch"}] if REPOSITORY else [],
    # Pages of one function or class need the full width for their examples.
    "secondary_sidebar_items": {
        "[!r]**": ["page-toc"],
        "reference/[!a]**": ["page-toc"],
        "reference/api/**": [],
    },
    "footer_start": ["copyright"],
    "footer_end": [],
    "search_bar_text": "Search the documentation",
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
copybutton_selector = ":not(.output) > div.highlight > pre"  # not what a program prints


def write_generated_pages(app: Sphinx) -> None:
    """Write the files that are generated from the code: pages of laws, tables and diagrams."""
    from generate import architecture, laws, methods, slots, theory, validation, verification

    for part in (
        laws.write_pages,
        methods.write_tables,
        validation.write_tables,
        slots.write_table,
        architecture.write_pictures,
        theory.write_parts,
        verification.write_pages,
    ):
        part(DOCS)


def plain_signature(
    app: Sphinx, what: str, name: str, obj: object, options: object, signature: str | None, returned: str | None
) -> tuple[str | None, str | None]:
    """Return a signature as one would write it: Sphinx has its own words for aliases and for defaults made anew."""
    if signature is not None:
        signature = re.sub(r"TypeAliasForwardRef\('(\w+)'\)", r"\1", signature).replace("<factory>", "...")
    return signature, returned


def tidy_page(app: Sphinx, page: nodes.document) -> None:
    """Make figures of files links to their full size, and take empty lines from the ends of included programs."""
    for figure in page.findall(nodes.image):
        if not figure["uri"].startswith("data:") and "jupyter_execute" not in figure["uri"]:
            figure["width"] = "100%"
    for block in page.findall(nodes.literal_block):
        if (text := block.astext()).endswith("\n\n"):
            block.rawsource = text.rstrip("\n") + "\n"
            block.children = [nodes.Text(block.rawsource)]


def package_digest() -> str:
    """Return a digest of the package's code, on which the results of programs in pages depend."""
    digest = hashlib.sha256()
    for file in sorted(Path(wd.__file__).parent.rglob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def setup(app: Sphinx) -> None:
    """Have these pages written before Sphinx looks for pages, and all pages tidied."""
    # Pages are made again if the package's code has changed, and the results of their programs are kept by its digest.
    app.add_config_value("digest_of_code", package_digest(), "env")
    app.config.nb_execution_cache_path = str(app.outdir / ".jupyter_cache" / app.config.digest_of_code)
    app.connect("builder-inited", write_generated_pages, priority=100)
    app.connect("autodoc-process-signature", plain_signature)
    app.connect("doctree-read", tidy_page)
