"""`jaxsat versions`: what a report of a fault should say."""


def versions() -> int:
    """Print the versions of what numbers depend on, and the device they are computed on.

    Example: jaxsat versions
    """
    import platform

    import jax

    from jaxsat.versions import versions as installed

    for name, version in installed().items():
        print(f"{name:8} {version}")
    print(f"{'system':8} {platform.system()} {platform.machine()}")
    print(f"{'device':8} {', '.join(str(device) for device in jax.devices())}")
    return 0
