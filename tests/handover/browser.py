"""A headless Chromium over its debugging protocol.

Run `python tests/handover/browser.py docs/handover/view.png` for the picture in the docs.
"""

from __future__ import annotations

import base64
import itertools
import json
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request
from contextlib import contextmanager

CHROMIUM = next((p for p in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if p), None)
FLAGS = ("--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
         "--hide-scrollbars", "--window-size=1280,800", "--no-first-run")  # fmt: skip


@contextmanager
def page(url, port=9333):
    """A function that sends a command to a page at `url` and returns its result."""
    from websockets.sync.client import connect

    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        words = [CHROMIUM, *FLAGS, f"--remote-debugging-port={port}", f"--user-data-dir={profile}", url]
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            address = wait(lambda: _address(port), 30)
            with connect(address, max_size=None) as socket:
                numbers = itertools.count(1)

                def send(method, **parameters):
                    number = next(numbers)
                    socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
                    while True:
                        answer = json.loads(socket.recv(timeout=60))
                        if answer.get("id") == number:
                            return answer["result"]

                yield send
        finally:
            process.terminate()
            process.wait(20)


def _address(port):
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json", timeout=2) as answer:
            pages = [entry for entry in json.load(answer) if entry["type"] == "page"]
        return pages[0]["webSocketDebuggerUrl"] if pages else None
    except OSError:
        return None


def wait(ask, seconds):
    """The first answer that is not false, asked for at most so many seconds."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        answer = ask()
        if answer:
            return answer
        time.sleep(0.3)
    raise TimeoutError(f"nothing within {seconds} s")


def text(send):
    """All text of the page."""
    found = send("Runtime.evaluate", expression="document.body ? document.body.innerText : ''")
    return found["result"].get("value", "")


def picture(send):
    """PNG of the page."""
    return base64.b64decode(send("Page.captureScreenshot", format="png")["data"])


if __name__ == "__main__":
    from mlnlite.domains.handover import make_scene
    from mlnlite.domains.handover.show.viewer import open_view

    server = open_view(make_scene("mug", "to_pour", "L-M"), port=8799)
    with page("http://127.0.0.1:8799") as send:
        wait(lambda: "pass safe" in text(send), 60)
        time.sleep(8)
        with open(sys.argv[1], "wb") as file:
            file.write(picture(send))
    server.stop()
