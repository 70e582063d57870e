#!/usr/bin/env python3
"""Opens a report in headless Chromium, on a desk and on a phone, and prints as JSON what a person would see: whether the
map was drawn, what it says of a place, errors on the console, and by how much the page is wider than a phone. Exit
status 77: no Chromium.

    report_in_browser.py REPORT.html NORTH EAST [PICTURE.png]
"""
import json
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from browser import browser, errors, open_page, too_wide_px  # noqa: E402

# Puts the place into the middle of the map and asks for it by the keyboard.
ASK = """
const [north, east] = arguments, canvas = document.querySelector('#viewer canvas');
const data = JSON.parse(document.getElementById('map-data').textContent);
const press = (key) => canvas.dispatchEvent(new KeyboardEvent('keydown', {key, bubbles: true}));
press('0');
const scale = 0.96 * Math.min(canvas.clientWidth / (data.cols * data.cell_m),
                              canvas.clientHeight / (data.rows * data.cell_m));
const x = canvas.clientWidth / 2 + (east - data.east_m - data.cols * data.cell_m / 2) * scale;
const y = canvas.clientHeight / 2 - (north - data.north_m - data.rows * data.cell_m / 2) * scale;
const box = canvas.getBoundingClientRect();
for (const type of ['pointerdown', 'pointerup'])
  canvas.dispatchEvent(new PointerEvent(type, {pointerId: 1, clientX: box.left + x, clientY: box.top + y,
                                               bubbles: true}));
return document.querySelector('[data-part=readout]').textContent;
"""


def main():
    report, north, east = pathlib.Path(sys.argv[1]).resolve(), float(sys.argv[2]), float(sys.argv[3])
    with tempfile.TemporaryDirectory() as folder:
        driver = browser(folder)
        try:
            open_page(driver, report.as_uri(), phone=False)
            seen = {"title": driver.title,
                    "drawn": driver.execute_script("return !document.getElementById('viewer').hidden"),
                    "says": driver.execute_script(ASK, north, east),
                    "layers": driver.execute_script(
                        "return [...document.querySelectorAll('[data-part=layer] option')].map(o => o.value)")}
            if len(sys.argv) > 4:
                driver.save_screenshot(sys.argv[4])
            open_page(driver, report.as_uri(), phone=True)
            seen["too_wide_px"] = too_wide_px(driver)
            seen["errors"] = errors(driver)
            if len(sys.argv) > 4:
                driver.save_screenshot(sys.argv[4].replace(".png", "-phone.png"))
        finally:
            driver.quit()
    print(json.dumps(seen))


main()
