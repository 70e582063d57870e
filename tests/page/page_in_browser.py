#!/usr/bin/env python3
"""Opens the page of a vehicle in headless Chromium, on a desk and on a phone, and prints as JSON what a person would see:
texts by name, elements that text from the vehicle became, errors on the console, and by how much the page is wider than a
phone. Exit status 77: no Chromium.

    page_in_browser.py URL [PICTURE.png]
"""
import json
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from browser import browser, errors, open_page, too_wide_px  # noqa: E402

IS_READY = "document.body.dataset.heard == 'yes' && document.getElementById('viewer').dataset.ready == 'yes'"
TEXTS = """
return Object.fromEntries([...document.querySelectorAll('[data-live]')].map((e) => [e.dataset.live, e.textContent]))
"""


def main():
    url = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        driver = browser(folder)
        try:
            open_page(driver, url, False, IS_READY)
            seen = {"texts": driver.execute_script(TEXTS),
                    "images": driver.execute_script("return document.images.length"),
                    "scripts": driver.execute_script("return document.scripts.length"),
                    "broken": driver.execute_script("return 'broken' in window")}
            if len(sys.argv) > 2:
                driver.save_screenshot(sys.argv[2])
            open_page(driver, url, True, IS_READY)
            seen["too_wide_px"] = too_wide_px(driver)
            seen["errors"] = errors(driver)
            if len(sys.argv) > 2:
                driver.save_screenshot(sys.argv[2].replace(".png", "-phone.png"))
        finally:
            driver.quit()
    print(json.dumps(seen))


main()
