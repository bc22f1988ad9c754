"""Find or install Chromium for the browser tests, and print which."""

import ctypes
import os
import shutil
import subprocess
import sys
from pathlib import Path

NAMES = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
"""The first one is headless and opens a page in half the time."""


def find() -> str | None:
    """Path of an installed Chromium: CHROMIUM, one on PATH, or Playwright's download."""
    for candidate in (os.environ.get("CHROMIUM"), *(shutil.which(name) for name in NAMES)):
        if candidate and Path(candidate).is_file():
            return candidate
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        own = playwright.chromium.executable_path
    return own if own and Path(own).is_file() else None


PR_CAPBSET_DROP, CAP_SYS_NICE = 24, 23
"""Of linux/prctl.h and linux/capability.h."""


def keep_priority() -> None:
    """Programs started from here cannot raise their priority.

    As root, Chromium would draw ahead of everything else, and drawing 3D in software would starve the servers.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, CAP_SYS_NICE, 0, 0, 0)  # fails harmlessly for other users


def install() -> str | None:
    """Install Debian's package as root with apt, else Playwright's own download."""
    if os.geteuid() == 0 and shutil.which("apt-get"):
        print("Chromium is missing: installing Debian's package with apt-get ...", flush=True)
        environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
        subprocess.run(["apt-get", "update", "-qq"], check=False, env=environment)
        packages = ["chromium-headless-shell", "fonts-dejavu-core", "fonts-ipafont-gothic"]  # the last for Japanese
        subprocess.run(
            ["apt-get", "install", "-y", "-qq", "--no-install-recommends", *packages],
            check=False, env=environment, stdout=subprocess.DEVNULL,
        )  # fmt: skip
    if find() is None:
        print("Chromium is missing: downloading Playwright's own ...", flush=True)
        subprocess.run([sys.executable, "-m", "playwright", "install", "chromium"], check=False)
    return find()


def main() -> int:
    """Exit 1 with the remedy if Chromium is neither found nor installed."""
    found = find() or install()
    if found is None:
        print("No Chromium: install it, or name it in the environment variable CHROMIUM.", file=sys.stderr)
        return 1
    print(f"Chromium for the browser tests: {found}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
