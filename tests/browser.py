"""Headless Chromium, driven over its own protocol: real clicks and drags on a page, and every complaint in its console."""

import contextlib
import json
import pathlib
import shutil
import subprocess
import tempfile
import time
import os

import pytest
import websocket

# No look-ups and downloads of its own, and no rest for a page that it takes for unseen; tests run as root in containers, where
# Chromium's sandbox does not start.
FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage", "--disable-background-timer-throttling",
    "--disable-backgrounding-occluded-windows", "--disable-renderer-backgrounding", "--remote-debugging-port=0",
    "--remote-allow-origins=*",
]  # fmt: skip
PATIENCE = 60.0
# Seconds without a frame after which the browser is believed to draw no more: a frame of our slowest page takes a tenth.
FRAME = 10.0


class Stalled(Exception):
    """The browser answers but draws no frames: scrolling, sizes and what waits for sight stand still. A matter of headless
    Chromium and never of a page: tests that may start again in another one are marked with `AGAIN`."""


AGAIN = pytest.mark.flaky(reruns=2, only_rerun=Stalled.__name__)


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
        self.call("Page.bringToFront")
        self.call("Page.navigate", url=pathlib.Path(path).resolve().as_uri())
        self.wait("document.readyState === 'complete'")

    def run(self, script):
        """Value of an expression on the page."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def wait(self, condition):
        start = time.monotonic()
        checked = start
        while not self.run(condition):
            now = time.monotonic()
            assert now < start + PATIENCE, f"never became true: {condition}"
            if now > checked + FRAME:
                self._expect_frame()
                checked = now
            time.sleep(0.05)

    def _expect_frame(self):
        drawn = "new Promise(done => requestAnimationFrame(() => done(true)))"
        late = f"new Promise(done => setTimeout(() => done(false), {1000 * FRAME}))"
        if not self.run(f"Promise.race([{drawn}, {late}])"):
            raise Stalled(f"no frame within {FRAME:.0f} s; the page is {self.run('document.visibilityState')}")

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
        profile = pathlib.Path(profile)
        # Into a file: a pipe that nobody reads would stop the browser when it is full.
        with open(profile / "complaints.txt", "w") as complaints:
            command = [chromium(), *FLAGS, f"--user-data-dir={profile}", "about:blank"]
            program = subprocess.Popen(command, stderr=complaints, env=os.environ | {"TMPDIR": str(profile)})
        try:
            address = _address(program, profile)
            browser = websocket.create_connection(address, timeout=PATIENCE)
            browser.send(json.dumps({"id": 1, "method": "Target.getTargets"}))
            while (message := json.loads(browser.recv())).get("id") != 1:
                pass
            page = next(t for t in message["result"]["targetInfos"] if t["type"] == "page")
            yield Tab(address.partition("devtools")[0] + f"devtools/page/{page['targetId']}")
        finally:
            program.kill()
            program.wait(timeout=PATIENCE)


def _address(program, profile):
    """Where the browser listens: it writes port and path into its profile."""
    port = profile / "DevToolsActivePort"
    end = time.monotonic() + PATIENCE
    while not (port.is_file() and len(lines := port.read_text().split()) == 2):
        if program.poll() is not None or time.monotonic() > end:
            pytest.fail(f"Chromium does not listen: {(profile / 'complaints.txt').read_text()[-2000:]}")
        time.sleep(0.05)
    return f"ws://127.0.0.1:{lines[0]}{lines[1]}"
