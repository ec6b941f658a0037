"""Screenshots of reports in a headless Chromium, for the documentation."""

import io
import shutil
from pathlib import Path

SIZE = {"width": 1100, "height": 800}
COLOURS = 128  # of a picture: what a page needs, in a fraction of the bytes
PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
SETTLED = 1500  # ms, for charts to be drawn


def take(
    report: Path, picture: Path, scheme: str, place: str = "", time: float | None = None
) -> None:
    """Write a PNG of a report as a browser shows it, in the scheme `light` or `dark`.

    `place` is the CSS selector of what stands at the top, `time` that of the clock in s.
    """
    from PIL import Image
    from playwright.sync_api import sync_playwright

    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if program is None:
        raise SystemExit("screenshots need chromium: it is not installed")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=program, args=["--no-sandbox", "--disable-gpu"]
        )
        page = browser.new_page(color_scheme=scheme, viewport=SIZE)
        page.goto(report.absolute().as_uri())
        page.wait_for_function("frictionsim.ready")
        if time is not None:
            page.evaluate("(time) => frictionsim.show(time)", time)
        if place:
            page.locator(place).evaluate("(element) => element.scrollIntoView()")
        page.wait_for_timeout(SETTLED)
        shot = page.screenshot()
        browser.close()
    image = Image.open(io.BytesIO(shot)).convert("RGB")
    image.quantize(COLOURS, dither=Image.Dither.NONE).save(picture, optimize=True)
