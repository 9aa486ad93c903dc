"""Checks that the search of the built site finds the right page first: `python docs/check_search.py results/site`.

The points are those of Sphinx' `searchtools.js`: of index entries, titles, objects and words of the text.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

from snowballstemmer import stemmer

FIRST = {
    "OpenSees": "coming_from/openseespy",
    "OpenSeesPy": "coming_from/openseespy",
    "MSA": "tutorials/designs_compared",
    "multiple stripe analysis": "tutorials/designs_compared",
    "IDA": "tutorials/designs_compared",
    "incremental dynamic analysis": "tutorials/designs_compared",
    "P-Delta": "how_to/buildings",
    "P-695": "how_to/collapse_margin",
    "collapse margin ratio": "how_to/collapse_margin",
    "CMR": "how_to/collapse_margin",
    "tuned mass damper": "how_to/compare_designs",
    "optimisation": "how_to/compare_designs",
    "friction pendulum": "how_to/friction_pendulums",
    "base isolation": "how_to/friction_pendulums",
    "rotating machine": "how_to/machine_vibration",
    "unbalance": "how_to/machine_vibration",
    "first passage": "how_to/first_passage",
    "reliability": "how_to/first_passage",
    "subset simulation": "how_to/rare_events",
    "importance sampling": "how_to/rare_events",
    "rare event": "how_to/rare_events",
    "response spectrum": "how_to/records",
    "soil-structure interaction": "how_to/built_structures",
    "SSI": "how_to/built_structures",
    "torsion": "how_to/built_structures",
    "FAQ": "faq",
    "cite": "citation",
    "licence": "licence",
    "license": "licence",
    "comparison": "comparison",
    "sensitivity": "how_to/sensitivity",
    "tornado": "reference/api/generated/warpdyn.tornado",
    "tornado diagram": "how_to/sensitivity",
    "calibration": "how_to/calibration",
    "measured loop": "how_to/calibration",
    "aftershock": "tutorials/aftershocks",
    "state-dependent fragility": "how_to/loads_and_designs",
    "expected annual loss": "tutorials/hazus_to_loss",
    "average annual loss": "how_to/portfolios_and_files",
    "spreadsheet": "how_to/portfolios_and_files",
    "join runs": "how_to/portfolios_and_files",
    "release notes": "release_notes",
    "gallery": "gallery",
}
TITLE, PARTIAL_TITLE, TERM, PARTIAL_TERM = 15, 7, 5, 2
NAME, PART_OF_NAME, PRIORITY = 11, 6, {0: 15, 1: 5, 2: -5}


def read_index(site: Path) -> dict[str, Any]:
    """Return the search index of a site."""
    text = (site / "searchindex.js").read_text(encoding="utf-8")
    index: dict[str, Any] = json.loads(text[text.index("(") + 1 : text.rindex(")")])
    return index


def files_of(entry: int | list[int] | None) -> list[int]:
    """Return the numbers of the pages of a word."""
    return [] if entry is None else entry if isinstance(entry, list) else [entry]


def _titles_and_entries(index: dict[str, Any], query: str) -> list[tuple[float, int]]:
    found = []
    for title, places in index["alltitles"].items():
        if query in title.lower().strip() and len(query) >= len(title) / 2:
            points = round(TITLE * len(query) / len(title))
            found += [(points + (index["titles"][page] == title), page) for page, _ in places]
    for entry, places in index["indexentries"].items():
        if query in entry and len(query) >= len(entry) / 2:
            points = round(100 * len(query) / len(entry))
            found += [(points, page) for page, _, is_main in places if is_main]  # others are listed after all results
    return found


def _objects(index: dict[str, Any], query: str) -> list[tuple[float, int]]:
    found = []
    terms = set(query.split())
    for term in terms:
        for prefix, rows in index["objects"].items():
            for page, kind, priority, _, name in rows:
                full = f"{prefix}.{name}" if prefix else name
                if term not in full.lower():
                    continue
                last = full.lower().split(".")[-1]
                points = NAME if term in (full.lower(), last) else PART_OF_NAME if term in last else 0
                words = f"{prefix} {name} {index['objnames'][str(kind)][2]} {index['titles'][page]}".lower()
                if all(other in words for other in terms - {term}):
                    found.append((points + PRIORITY.get(priority, 0), page))
    return found


def _words(index: dict[str, Any], query: str) -> list[tuple[float, int]]:
    stem = stemmer("english").stemWord
    best: dict[int, list[float]] = {}
    words = [stem(word) for word in re.findall(r"[\w]+", query) if not word.isdigit()]
    for word in words:
        points: dict[int, float] = {}
        for table, whole, part in (("terms", TERM, PARTIAL_TERM), ("titleterms", TITLE, PARTIAL_TITLE)):
            for page in files_of(index[table].get(word)):
                points[page] = max(points.get(page, 0), whole)
            if len(word) > 2 and word not in index["terms"] and word not in index["titleterms"]:
                for other, pages in index[table].items():
                    if word in other:
                        for page in files_of(pages):
                            points[page] = max(points.get(page, 0), part)
        for page, value in points.items():
            best.setdefault(page, []).append(value)
    return [(max(values), page) for page, values in best.items() if len(values) == len(words)]


def search(index: dict[str, Any], query: str) -> list[tuple[float, str]]:
    """Return the pages that a query finds with their points, the best first."""
    query = query.lower().strip()
    points: dict[int, float] = {}
    for value, page in _titles_and_entries(index, query) + _objects(index, query) + _words(index, query):
        points[page] = max(points.get(page, -10), value)
    ranked = sorted(points.items(), key=lambda item: (-item[1], index["titles"][item[0]].lower()))
    return [(value, index["docnames"][page]) for page, value in ranked]


def misplaced(site: Path) -> list[str]:
    """Return the queries that find another page first, with that page."""
    index = read_index(site)
    wrong = []
    for query, page in FIRST.items():
        found = search(index, query)
        best = [name for value, name in found if value == found[0][0]]
        if best != [page]:
            wrong.append(f"{query}: {', '.join(best) or 'nothing'} instead of {page}")
    return wrong


if __name__ == "__main__":
    found = misplaced(Path(sys.argv[1]))
    print("\n".join(found) or f"the search finds the right page first for {len(FIRST)} queries")
    sys.exit(bool(found))
