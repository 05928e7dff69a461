"""A headless Chromium driven by the DevTools protocol: opens a page, runs scripts in it, takes screenshots."""

import base64
import contextlib
import itertools
import json
import shutil
import subprocess
import time
import urllib.request

import cv2
import numpy as np
from websockets.sync.client import connect

CHROMIUM = next((found for name in ("chromium", "chromium-browser") if (found := shutil.which(name))), None)
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--remote-debugging-port=0",
)


class Browser:
    """One page in a window of its own."""

    def __init__(self, folder, width=1400, height=840):
        size = f"--window-size={width},{height}"
        self._process = subprocess.Popen(
            [CHROMIUM, *FLAGS, size, f"--user-data-dir={folder}", "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self._number = itertools.count(1)
        try:
            told = folder / "DevToolsActivePort"
            wait_for(lambda: told.is_file() and len(told.read_text().splitlines()) == 2, 60)
            port = told.read_text().splitlines()[0]
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/json") as answer:
                pages = [one for one in json.load(answer) if one["type"] == "page"]
            self._socket = connect(pages[0]["webSocketDebuggerUrl"], max_size=None)
        except BaseException:
            self._process.kill()
            self._process.wait()
            raise

    def call(self, method, **values):
        number = next(self._number)
        self._socket.send(json.dumps({"id": number, "method": method, "params": values}))
        while True:
            answer = json.loads(self._socket.recv(timeout=60))
            if answer.get("id") == number:
                return answer.get("result", {})

    def open(self, address):
        self.call("Page.navigate", url=address)

    def text(self):
        """What the page says."""
        found = self.call("Runtime.evaluate", expression="document.body ? document.body.innerText : ''")
        return found.get("result", {}).get("value", "")

    def picture(self):
        """(height, width, 3) uint8 red, green, blue."""
        # Chromium cannot take one while it is about to draw the page for the first time.
        data = base64.b64decode(
            wait_for(lambda: self.call("Page.captureScreenshot", format="png").get("data"), 20)
        )
        return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[..., ::-1].astype(int)

    def close(self):
        with contextlib.suppress(Exception):
            self.call("Browser.close")
        self._socket.close()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def wait_for(is_there, seconds):
    """Waits until something is so; tells what it was last if it never is."""
    end = time.monotonic() + seconds
    while not (found := is_there()):
        if time.monotonic() > end:
            raise TimeoutError(f"waited {seconds} s in vain; it is {found!r}")
        time.sleep(0.1)
    return found
