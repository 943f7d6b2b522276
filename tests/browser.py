"""Headless Chromium, driven over its own protocol: real clicks and drags on a page, and every complaint in its console."""

import contextlib
import json
import pathlib
import re
import shutil
import subprocess
import tempfile
import time
import os

import pytest
import websocket

# No look-ups and downloads of its own; tests run as root in containers, where Chromium's sandbox does not start.
FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage", "--remote-debugging-port=0",
    "--remote-allow-origins=*",
]  # fmt: skip
PATIENCE = 60.0


def chromium():
    """Path of a Chromium; installs Debian's where that is possible, and skips the test where it is not."""
    names = ("chromium", "chromium-browser", "google-chrome")
    found = next(filter(None, map(shutil.which, names)), None)
    if found is None and os.geteuid() == 0 and shutil.which("apt-get"):
        subprocess.run("apt-get update && apt-get install --yes --no-install-recommends chromium", shell=True, capture_output=True)
        found = shutil.which("chromium")
    if found is None:
        pytest.skip("NO BROWSER: the pages were not looked at; install chromium")
    return found


class Tab:
    """One page in the browser."""

    def __init__(self, address):
        self._socket = websocket.create_connection(address, timeout=PATIENCE)
        self._number = 0
        self.complaints = []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.requests = []

    def call(self, method, **parameters):
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._socket.recv())
            if message.get("id") == self._number:
                assert "error" not in message, f"{method}: {message['error']}"
                return message["result"]
            self._hear(message)

    def _hear(self, message):
        method, parameters = message.get("method"), message.get("params", {})
        if method == "Runtime.exceptionThrown":
            details = parameters["exceptionDetails"]
            self.complaints.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning", "assert"):
            self.complaints.append(" ".join(str(argument.get("value")) for argument in parameters["args"]))
        elif method == "Log.entryAdded" and parameters["entry"]["level"] == "error":
            self.complaints.append(parameters["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(parameters["request"]["url"])

    def look(self, width, height, scheme="light"):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 600)
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def open(self, path):
        self.call("Page.navigate", url=pathlib.Path(path).resolve().as_uri())
        self.wait("document.readyState === 'complete'")

    def run(self, script):
        """Value of an expression on the page."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def wait(self, condition):
        end = time.monotonic() + PATIENCE
        while not self.run(condition):
            assert time.monotonic() < end, f"never became true: {condition}"
            time.sleep(0.05)

    def show(self, element):
        """Scrolls to an element and gives its place on the screen."""
        script = f"(() => {{ const e = {element}; e.scrollIntoView({{block: 'center', behavior: 'instant'}});"
        return self.run(script + " const r = e.getBoundingClientRect(); return [r.x, r.y, r.width, r.height]; })()")

    def _mouse(self, kind, x, y, buttons):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=buttons, clickCount=1)

    def click(self, element):
        x, y, width, height = self.show(element)
        for kind, buttons in (("mousePressed", 1), ("mouseReleased", 0)):
            self._mouse(kind, x + width / 2, y + height / 2, buttons)

    def drag(self, element, start, end):
        """Drags from one place inside an element to another, both as shares of its size."""
        x, y, width, height = self.show(element)
        places = [(x + width * a, y + height * b) for a, b in (start, end)]
        self._mouse("mouseMoved", *places[0], 0)
        self._mouse("mousePressed", *places[0], 1)
        for share in (0.3, 0.6, 1.0):
            self._mouse("mouseMoved", *(p + share * (q - p) for p, q in zip(*places)), 1)
        self._mouse("mouseReleased", *places[1], 0)


@contextlib.contextmanager
def browse():
    """A browser with one empty page."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        program = subprocess.Popen(
            [chromium(), *FLAGS, f"--user-data-dir={profile}", "about:blank"], stderr=subprocess.PIPE, text=True
        )
        try:
            for line in program.stderr:
                if found := re.search(r"ws://[^/]+/", line):
                    break
            else:
                pytest.fail("Chromium ended before it listened")
            browser = websocket.create_connection(re.search(r"ws://\S+", line)[0], timeout=PATIENCE)
            browser.send(json.dumps({"id": 1, "method": "Target.getTargets"}))
            while (message := json.loads(browser.recv())).get("id") != 1:
                pass
            page = next(t for t in message["result"]["targetInfos"] if t["type"] == "page")
            yield Tab(f"{found[0]}devtools/page/{page['targetId']}")
        finally:
            program.terminate()
            program.wait(timeout=PATIENCE)
            program.stderr.close()
