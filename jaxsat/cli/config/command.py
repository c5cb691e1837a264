"""`jaxsat config`: a commented template of all settings."""


def config() -> int:
    """Print a commented configuration with every key, its unit and its default.

    Example: jaxsat config > session.toml
    """
    from jaxsat.cli.settings.files import template

    print(template(), end="")
    return 0
