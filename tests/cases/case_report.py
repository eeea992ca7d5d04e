# SPDX-License-Identifier: Apache-2.0
"""Figures of a case study: what was found, against what, how far off it is and may be."""
import re


class Report:
    def __init__(self, columns=("found", "against", "off, of what is allowed")):
        self.columns = columns
        self.rows, self.good, self.figures = [], True, {}

    def add(self, what, found, against, off, allowed, unit):
        good = off <= allowed
        self.good = self.good and good
        self.figures[what] = {"off": off, "allowed": allowed}
        self.rows.append((what, found, against, f"{off:.2g} of {allowed:g} {unit}".strip() + ("" if good else ": TOO FAR OFF")))

    def say(self, what, found, *more):
        """`more`: at most as many as there are further columns."""
        self.figures[what] = found
        self.rows.append((what, found, *more, *[""] * (len(self.columns) - 1 - len(more))))

    def table(self):
        return "\n".join(["| | " + " | ".join(self.columns) + " |", "|---" * (len(self.columns) + 1) + "|",
                          *("| " + " | ".join(row) + " |" for row in self.rows)])

    def print(self):
        print(self.table())

    def into_page(self, page, mark="figures"):
        """Puts the table between the page's two marks, the first of that name."""
        text = page.read_text()
        page.write_text(re.sub(rf"(<!-- {mark} -->\n).*?(<!-- end -->)", lambda m: m[1] + self.table() + "\n" + m[2], text, flags=re.S))
