"""Headless Chromium, as packaged by Debian."""

import os
import shutil

from selenium import webdriver


def chromium(*switches, preferences=None):
    """Start it with these switches besides; it trusts any certificate."""
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which('chromium')
    for switch in ('headless=new', *switches):
        options.add_argument(f'--{switch}')
    if os.geteuid() == 0:  # root cannot have Chromium's sandbox
        options.add_argument('--no-sandbox')
    options.accept_insecure_certs = True
    if preferences:
        options.add_experimental_option('prefs', preferences)
    return webdriver.Chrome(options, webdriver.ChromeService(shutil.which('chromedriver')))
