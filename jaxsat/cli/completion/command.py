"""`jaxsat completion`: what makes a shell complete commands, options and file names."""

from typing import Annotated, Literal

from cyclopts import Parameter


def completion(
    shell: Annotated[Literal["bash", "zsh", "fish"], Parameter(help="The shell that it is for.")],
    /,
) -> int:
    """Print a script with which a shell completes commands, options and files.

    Exit status: 0 done, 2 wrong usage.

    Example: jaxsat completion bash > ~/.local/share/bash-completion/completions/jaxsat

    Example: jaxsat completion zsh > ~/.zfunc/_jaxsat, with fpath+=~/.zfunc
    before compinit in ~/.zshrc

    Example: jaxsat completion fish > ~/.config/fish/completions/jaxsat.fish
    """
    from jaxsat.cli.main import app

    print(app.generate_completion(shell=shell), end="")
    return 0
