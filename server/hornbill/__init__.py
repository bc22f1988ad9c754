"""hornbill: a configurator for Futaba BLA15, BLA21 and BLA34 servos on DroneCAN."""

__version__: str


def __getattr__(name: str) -> str:
    """`__version__`, found at its first use: importlib.metadata takes a third of the import of hornbill.client."""
    if name != "__version__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib.metadata import PackageNotFoundError, version

    for distribution in ("hornbill", "hornbill-client"):
        try:
            globals()[name] = version(distribution)
            break
        except PackageNotFoundError:
            pass
    else:  # run from a checkout that was never installed
        globals()[name] = "0+unknown"
    return globals()[name]
