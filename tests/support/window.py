# SPDX-License-Identifier: Apache-2.0
"""What tests do with a window of any browser, by what it evaluates: waiting, texts of elements, violations of the security policy."""
import json
import time

from checks import PATIENCE_S

# Runs in each page before its own scripts.
WATCH_POLICY = ("window.violations = []; addEventListener('securitypolicyviolation', "
                "(e) => window.violations.push(`${e.effectiveDirective} ${e.blockedURI} ${e.sourceFile}:${e.lineNumber}`));")


class Window:
    """Base of the drivers, which have evaluate(), press() and `complaints`."""

    def wait_for(self, script, patience_s=PATIENCE_S):
        """First true value of an expression; None after the timeout."""
        end = time.monotonic() + patience_s
        while time.monotonic() < end:
            if (value := self.evaluate(script)) not in (None, False, 0, ""):  # an element comes as {}
                return value or True
            time.sleep(0.05)
        return None

    def text(self, selector):
        return self.evaluate(f"document.querySelector({json.dumps(selector)})?.textContent ?? null")

    def violations(self):
        """Of the content security policy, since the page was opened."""
        return self.evaluate("window.violations")

    def tab_to(self, selector, most=200):
        """Presses the tabulator until the element has the focus; false: it never has."""
        for _ in range(most):
            if self.evaluate(f"document.activeElement?.matches({json.dumps(selector)}) ?? false"):
                return True
            self.press("Tab")
        return False
