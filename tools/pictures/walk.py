#!/usr/bin/env python3
"""The pictures in the documentation, made from a recording: an animation of the replay, and the page of the walk.

    cargo walk --out /tmp/walk
    python3 tools/pictures/walk.py /tmp/walk/walk.mcap --animation docs/walk.webp --page docs/report.webp

Needs Chromium (or its path in SOLEUS_CHROMIUM). The page is `report.html` beside the recording, else made by
`soleus-inspect report`; its own replay is what is filmed, frame by frame. Pillow is installed into
tools/pictures/.venv-pictures only.
"""

import argparse
import base64
import io
import json
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "oracles"))
import environment

HERE = pathlib.Path(__file__).resolve().parent
# Frames a second of the animation, and how much faster than the walk it is.
FRAMES_HZ, SPEED = 12.5, 2.0
# Width of the animation, and of the page on its picture (px).
ANIMATION_PX, PAGE_PX = 400, 1500
QUALITY = 60


class Browser:
    """Chromium over its debugging pipe: no driver, no other package."""

    def __init__(self, program, width, height):
        self._profile = tempfile.TemporaryDirectory()
        to_read, self._to = os.pipe()
        self._from, from_write = os.pipe()
        flags = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-background-networking"]
        flags += ["--no-first-run", "--hide-scrollbars", "--remote-debugging-pipe"]
        command = ["sh", "-c", f'exec "$0" "$@" 3<&{to_read} 4>&{from_write}', program, *flags]
        command.append(f"--user-data-dir={self._profile.name}")
        quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self._process = subprocess.Popen(command, pass_fds=(to_read, from_write), **quiet)
        os.close(to_read), os.close(from_write)
        self._number, self._session, self._rest = 0, None, b""
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self.call("Page.enable")
        self.size(width, height)

    def size(self, width, height):
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", **metrics)

    def call(self, method, **parameters):
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while True:
            while b"\0" not in self._rest:
                read = os.read(self._from, 1 << 20)
                if not read:
                    sys.exit(f"the browser ended: {method}")
                self._rest += read
            answer, self._rest = self._rest.split(b"\0", 1)
            answer = json.loads(answer)
            if answer.get("id") == self._number:
                if "error" in answer:
                    sys.exit(f"{method}: {answer['error']}")
                return answer["result"]

    def evaluate(self, expression):
        answer = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            sys.exit(f"{expression}: {answer['exceptionDetails']}")
        return answer["result"].get("value")

    def open(self, path):
        self.call("Page.navigate", url=path.resolve().as_uri())
        self.evaluate(
            "new Promise((ready) => { const look = () => document.body && document.body.dataset.ready !== undefined"
            " ? ready() : setTimeout(look, 50); look(); })"
        )

    def close(self):
        self._process.kill()
        self._process.wait()


def page(recording):
    """The page of a recording."""
    beside = recording.with_name("report.html")
    if not beside.exists():
        command = [environment.inspect(), "report", recording]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return beside


def animation(browser, output):
    from PIL import Image

    head = json.loads(browser.evaluate("document.getElementById('head').textContent"))
    first, count, step = head["time"]["from"], head["time"]["n"], head["time"]["step"]
    end = first + (count - 1) * step
    frames, time_s = [], max(first, 0.0)
    while time_s <= end:
        # Two frames: one in which the page hears of the time, one in which it has drawn.
        drawn = browser.evaluate(
            f"location.hash = 't={time_s:.3f}'; new Promise((done) => requestAnimationFrame(() => setTimeout(() => "
            "requestAnimationFrame(() => done(document.getElementById('view').toDataURL('image/png'))), 20)))"
        )
        frame = Image.open(io.BytesIO(base64.b64decode(drawn.split(",")[1]))).convert("RGB")
        height = round(frame.height * ANIMATION_PX / frame.width)
        frames.append(frame.resize((ANIMATION_PX, height), Image.LANCZOS))
        time_s += SPEED / FRAMES_HZ
    options = {"duration": round(1000 / FRAMES_HZ), "loop": 0, "quality": QUALITY, "method": 6}
    frames[0].save(output, save_all=True, append_images=frames[1:], **options)
    print(f"{output}: {len(frames)} frames of {ANIMATION_PX} x {frames[0].height}, {os.path.getsize(output) / 1000:.0f} kB")


def picture(browser, output):
    from PIL import Image

    browser.size(PAGE_PX, 1000)
    taken = browser.call("Page.captureScreenshot", format="png", captureBeyondViewport=False)
    image = Image.open(io.BytesIO(base64.b64decode(taken["data"]))).convert("RGB")
    image.save(output, quality=80, method=6)
    print(f"{output}: {image.width} x {image.height}, {os.path.getsize(output) / 1000:.0f} kB")


def main(arguments):
    program = os.environ.get("SOLEUS_CHROMIUM", "chromium")
    browser = Browser(program, PAGE_PX, 1000)
    try:
        browser.open(page(arguments.recording))
        if arguments.animation:
            animation(browser, arguments.animation)
        if arguments.page:
            picture(browser, arguments.page)
    finally:
        browser.close()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording", type=pathlib.Path)
    parser.add_argument("--animation", metavar="FILE.webp")
    parser.add_argument("--page", metavar="FILE.webp")
    arguments = parser.parse_args()
    environment.enter(HERE / ".venv-pictures", HERE / "requirements.txt")
    main(arguments)
