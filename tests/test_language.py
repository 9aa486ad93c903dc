"""Plain language: `tests/language.py` finds phrases that are hard to read, and clean folders contain none of them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from language import PATTERNS, ROOT, files_in, matches_in, matches_of

import warpdyn as wd

pytestmark = pytest.mark.fast

CLEAN = ("warpdyn", "docs", "studies", "README.md", "CHANGELOG.md", "CONTRIBUTING.md")  # without matches
# For each pattern, in its order: a sentence that it finds, and a plain sentence with the same meaning.
EXAMPLES = (
    ("Motions, of which two are scaled, are read.", "The motions are read; two of them are scaled."),
    ("Each storey has a step of its own.", "Each storey has its own step."),
    ("A building of one's own is read.", "Your own building is read."),
    ("The second likewise.", "The second has the same limit."),
    ("It is run again at most so many times.", "It is run again at most MOST_RERUNS times."),
    ("All but for the first are kept.", "All except the first are kept."),
    ("Errors as of annual_rates.", "Errors: the same as those of annual_rates, as of version 0.1."),
    ("The number is told to the function.", "The number is passed to the function."),
    ("A unit that is wrong was never told of.", "A wrong unit was never reported."),
    ("The flag tells which samples failed.", "The flag marks the samples that failed."),
    ("The page says what differs.", "The page lists the differences."),
    ("The residual drift is none.", "The residual drift is missing; the argument is None."),
    (
        "If path is no file, it fails.",
        "If path is not a file, it fails. There is no file; it is no longer there. It is no softer than rubber.",
    ),
    ("None for none.", "None: no limit."),
    ("Where there is none, it stays.", "Without a limit, it stays."),
    ("It is 0 for none.", "It is 0 without a limit."),
    ("The reason stands in the test.", "The reason is in the test."),
    ("Leave it out.", "Remove resample=."),
    ("It takes one step a storey, one row a damage state.", "One step per storey; a step of a storey takes time."),
    ("It fails. What cannot run leaves the file.", "It fails. A run that cannot start keeps the file. What now?"),
    ("The step is what remains.", "Only the step remains."),
    ("A pair climbs up a ladder of rungs.", "The level of a pair increases by a constant factor."),
    ("There is no room for the legend.", "There is no space for the legend."),
    ("Give what simulate() returned.", "Pass the result of simulate()."),
    ("The legend tells the rates.", "The legend shows the rates."),
    ("The message says nothing.", "The message is empty."),
    ("Workers hand back the sums.", "Workers return the sums."),
    ("The run goes on.", "The run continues; it was going well."),
    ("It takes some 20 s.", "It takes about 20 s, with some loss."),
    ("The more so with long steps.", "Increasingly with long steps."),
    ("Threads compile side by side.", "Threads compile in parallel."),
    ("It was checked by another hand.", "It was checked independently."),
    ("It is wide for want of records.", "It is wide because there are too few records."),
    ("The memory is let go of.", "The memory is freed."),
    ("The sum comes to 1.", "The sum equals 1; the building comes to rest."),
    ("The mean stands beside the median.", "The mean is next to the median; --beside is an option."),
    ("No balance, in however short steps.", "No equilibrium, even with the shortest step."),
    ("The end thereof is free.", "Its end is free."),
    ("They are run in turn.", "They are run alternately."),
    ("They run by themselves.", "They run separately."),
    ("It runs by itself.", "It runs alone."),
    ("Errors such as are likely.", "Likely errors."),
    ("The table is held to the test.", "The table is compared with the test."),
    ("Had it not been cut, it would differ.", "If it had not been cut, it would differ."),
    ("It would differ, were it cut.", "It would differ if it were cut."),
    ("It costs hardly more.", "It costs 2 % more."),
    ("The estimate which came before.", "The earlier estimate."),
    ("The motion as it is.", "The motion without scaling."),
    ("The motions as they are.", "The motions without scaling."),
    ("It stays whatever happens.", "It stays in all cases, whatever the status."),
    ("It is nowhere.", "It is in no file."),
    ("The step shall be short.", "The step must be short."),
)


def test_each_pattern_has_an_example() -> None:
    assert len(EXAMPLES) == len(PATTERNS)


@pytest.mark.parametrize(("pattern", "example"), list(zip(PATTERNS, EXAMPLES, strict=False)))
def test_a_pattern_finds_its_example_and_no_pattern_finds_the_plain_sentence(
    pattern: str, example: tuple[str, str]
) -> None:
    hard, plain = example
    assert PATTERNS[pattern] in [advice for _, _, advice in matches_in(hard)], (pattern, hard)
    assert list(matches_in(plain)) == [], plain


def test_code_is_ignored_and_lines_are_right(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "# Heading\n\nText with `beside` as code.\n\n```python\n# beside\n```\n\nTwo lines,\none beside it.\n"
    )
    assert [(match.line, match.words) for match in matches_of(page)] == [(10, "beside")]
    module = tmp_path / "module.py"
    module.write_text('"""Text.\n\nThe mean beside the median.\n"""\n\nbeside = 1  # the value\n# likewise\n')
    assert [(match.line, match.words) for match in matches_of(module)] == [(7, "likewise"), (3, "beside")]


@pytest.mark.parametrize("name", CLEAN)
def test_clean_text_has_no_matches(name: str) -> None:
    # Continuous integration tests an installed package, away from the checkout's folder.
    files = files_in([Path(wd.__file__).parent if name == "warpdyn" else ROOT / name])
    assert files, name
    assert [str(match) for file in files for match in matches_of(file)] == []


def test_the_glossary_is_sorted_and_each_term_has_an_anchor() -> None:
    text = (ROOT / "docs/reference/glossary.md").read_text(encoding="utf-8")
    terms = re.findall(r"^\*\*(.+)\*\*$", text, flags=re.MULTILINE)
    assert len(terms) > 40
    assert terms == sorted(terms, key=str.casefold)
    anchors = re.findall(r"^\(term-(.+)\)=\n\*\*(.+)\*\*$", text, flags=re.MULTILINE)
    named = [re.sub(r" \(.*\)", "", term).casefold().replace(" ", "-") for term in terms]
    assert [anchor for anchor, _ in anchors] == named
