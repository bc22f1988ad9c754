"""hornbill: a configurator for Futaba BLA15, BLA21 and BLA34 servos on DroneCAN."""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("hornbill")
except PackageNotFoundError:  # run from a checkout that was never installed
    __version__ = "0+unknown"
