"""Headless Chromium, as packaged by Debian or as a snap, which Ubuntu has in place of packages."""

import os
import shutil

from selenium import webdriver

INSTALL = (
    'on Debian sudo apt install chromium chromium-driver, on Ubuntu sudo snap install chromium'
)
_SNAPS = '/snap/'


def browser_path() -> str | None:
    """Return where the browser is; None if there is none."""
    return shutil.which('chromium')


def driver_path() -> str | None:
    """Return where its driver is, which the snap calls otherwise; None if there is none."""
    return shutil.which('chromedriver') or shutil.which('chromium.chromedriver')


def chromium(*switches, preferences=None):
    """Start it with these switches besides; it trusts any certificate."""
    options = webdriver.ChromeOptions()
    browser = browser_path()
    if browser and not browser.startswith(_SNAPS):  # a snap's driver knows where its browser is
        options.binary_location = browser
    for switch in ('headless=new', *switches):
        options.add_argument(f'--{switch}')
    if os.geteuid() == 0:  # root cannot have Chromium's sandbox
        options.add_argument('--no-sandbox')
    options.accept_insecure_certs = True
    if preferences:
        options.add_experimental_option('prefs', preferences)
    return webdriver.Chrome(options, webdriver.ChromeService(driver_path()))
