#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Holds the documents to a form that can be read: paragraphs and table cells of limited length, no heading twice on a page, and
links to headings that exist. Checked are README, CONTRIBUTING and docs/*.md; links also of the generated pages below docs/.
Comments in the source begin with their subject, and name it."""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
MAX_PARAGRAPH_WORDS = 120
MAX_CELL_WORDS = 40


def words(text):
    """Number of words as they are read: a link counts as its text."""
    return len(re.sub(r"\]\([^)]*\)", "]", text).split())


def blocks(text):
    """(line number, kind, text) of each heading, table row and paragraph; list items are paragraphs of their own."""
    paragraph, start = [], 0
    in_fence = False
    for number, line in enumerate([*text.splitlines(), ""], 1):
        is_fence = line.startswith("```")
        in_fence ^= is_fence
        is_code = in_fence or is_fence or (line.startswith("    ") and not paragraph)
        is_item = re.match(r"\s*([-*]|\d+\.)\s", line) is not None
        ends = not line.strip() or line.startswith(("#", "|")) or is_code or is_item
        if ends and paragraph:
            yield start, "paragraph", " ".join(paragraph)
            paragraph = []
        if is_code or not line.strip():
            continue
        if line.startswith("#"):
            yield number, "heading", line.lstrip("#").strip()
        elif line.startswith("|"):
            yield number, "row", line
        else:
            start = start if paragraph else number
            paragraph.append(line)


def complaints_of(name, text):
    headings = {}
    for number, kind, block in blocks(text):
        if kind == "paragraph" and words(block) > MAX_PARAGRAPH_WORDS:
            yield f"{name}:{number}: a paragraph of {words(block)} words; at most {MAX_PARAGRAPH_WORDS}"
        if kind == "row":
            for cell in re.split(r"(?<!\\)\|", block):
                if words(cell) > MAX_CELL_WORDS:
                    yield f"{name}:{number}: a table cell of {words(cell)} words; at most {MAX_CELL_WORDS}"
        if kind == "heading":
            if block in headings:
                yield f"{name}:{number}: the heading '{block}' stands in line {headings[block]} already"
            headings.setdefault(block, number)


def self_test():
    """The check notices what it is there for."""
    long_text = "word " * (MAX_PARAGRAPH_WORDS + 1)
    samples = {long_text: "paragraph", "- item\n  " + long_text: "paragraph", "| a | " + "b " * (MAX_CELL_WORDS + 1) + "|": "cell",
               "# A\n\ntext\n\n## A\n": "heading"}
    for sample, expected in samples.items():
        found = list(complaints_of("sample", sample))
        if len(found) != 1 or expected not in found[0]:
            return [f"words_test.py: a sample with a {expected} at fault gives {found}"]
    good = "# A\n\n" + ("word " * MAX_PARAGRAPH_WORDS + "\n\n") * 2 + "    " + long_text + "\n\n```\n" + long_text + "\n```\n"
    return [f"words_test.py: a good page gives {found}" for found in complaints_of("sample", good)]


def anchors_of(text):
    """Names by which links reach the headings of a page, as GitHub makes them."""
    return {re.sub(r"[^\w\- ]", "", block.lower()).replace(" ", "-") for _, kind, block in blocks(text) if kind == "heading"}


def broken_links(document):
    text = document.read_text(encoding="utf-8")
    for page, anchor in re.findall(r"\]\(([\w./-]*)#([\w-]+)\)", text):
        target = document.parent / page if page else document
        if target.suffix == ".md" and target.exists() and anchor not in anchors_of(target.read_text(encoding="utf-8")):
            yield f"{document.relative_to(ROOT)}: links to {page}#{anchor}, and there is no such heading"


# A comment must not begin with "Of", or use the pronouns below: it leaves out what it is about.
VAGUE_COMMENT = re.compile(r"(?://[/!]?<?|^\s*#)\s+(?:Of \w|.*\b(?:[Nn]obody|[Ss]omebody|[Aa]nybody|[Ee]verybody|[Ww]hoever)\b)")


def vague_comments(document):
    for number, line in enumerate(document.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
        if VAGUE_COMMENT.search(line) and "://" not in line:
            yield f"{document.relative_to(ROOT)}:{number}: a comment without its subject: {line.strip()}"


complaints = self_test()
pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
for document in pages:
    complaints += complaints_of(document.relative_to(ROOT), document.read_text(encoding="utf-8"))
for document in {*pages, ROOT / "CHANGELOG.md", *(ROOT / "docs").rglob("*.md")}:
    complaints += broken_links(document)
GENERATED = {"obscura_calls.hpp", "calls.py", "aio_calls.py"}  # texts of the calls
for folder in sorted(path for path in ROOT.iterdir() if path.is_dir() and path.name not in {"build", "shared"} and path.name[0] != "."):
    for source in sorted(file for file in folder.rglob("*") if file.suffix in {".cpp", ".hpp", ".c", ".h", ".py", ".sh"}):
        if source.name not in GENERATED:
            complaints += vague_comments(source)
print("\n".join(complaints) or "the documents are in a form that can be read")
sys.exit(1 if complaints else 0)
