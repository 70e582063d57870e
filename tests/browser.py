"""Chromium without a screen, for tests that open a page. A script that imports it where there is no Chromium ends with
exit status 77."""
import os
import sys

try:
    from selenium import webdriver
    from selenium.webdriver.support.ui import WebDriverWait
except ImportError:
    sys.exit(77)
if not os.path.exists("/usr/bin/chromium") or not os.path.exists("/usr/bin/chromedriver"):
    sys.exit(77)

PHONE_PX = 390
VIEWER_IS_READY = ("(!document.getElementById('viewer') || "
                   "document.getElementById('viewer').dataset.ready == 'yes')")


def browser(folder):
    options = webdriver.ChromeOptions()
    options.binary_location = "/usr/bin/chromium"
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
                     "--disable-background-networking", "--disable-component-update", "--disable-sync",
                     "--hide-scrollbars", f"--user-data-dir={folder}"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(options=options)


def open_page(driver, url, phone, is_ready=VIEWER_IS_READY):
    """Opens a page on a desk or on a phone, and waits until the JavaScript expression is_ready is true."""
    size = {"width": PHONE_PX, "height": 844, "deviceScaleFactor": 2} if phone else {
        "width": 1200, "height": 1000, "deviceScaleFactor": 1}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {**size, "mobile": phone})
    driver.get(url)
    WebDriverWait(driver, 20).until(
        lambda d: d.execute_script(f"return document.readyState == 'complete' && {is_ready}"))


def too_wide_px(driver):
    return driver.execute_script(f"return document.documentElement.scrollWidth - {PHONE_PX}")


def errors(driver):
    """What the page wrote to the console as errors."""
    return [entry["message"] for entry in driver.get_log("browser") if entry["level"] == "SEVERE"]
