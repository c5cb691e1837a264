"""A page as a notebook that has been run."""

import base64
import re

from pages import PICTURE, Block, Prose

MOST_BYTES = 500_000
"""Of a notebook."""


def notebook(cells: list[tuple[Prose | Block, dict[str, bytes]]]) -> bytes:
    """The page as a notebook that has been run: pictures and printed lines are outputs of the cells above them."""
    from nbformat import v4, validate, writes

    made: list = []
    for part, pictures in cells:
        if isinstance(part, Block):
            made.append(v4.new_code_cell(_cell(part), execution_count=1) if _is_code(part) else _fenced(part))
            if part.output:
                made[-1].outputs.append(v4.new_output("stream", name="stdout", text=part.output))
            continue
        code = [cell for cell in made if cell.cell_type == "code"]
        for data in pictures.values():
            shown = {"image/png": base64.b64encode(data).decode("ascii")}
            code[-1].outputs.append(v4.new_output("display_data", data=shown))
        text = re.sub(r"\]\((?!https?:|#)([^)\s]+)\)", r"](../\1)", PICTURE.sub("", part.text)).strip()
        if text:
            made.append(v4.new_markdown_cell(text))
    for number, cell in enumerate(made):
        # Random ones would make another file of the same page.
        cell.id = f"cell-{number}"
    for number, cell in enumerate((cell for cell in made if cell.cell_type == "code"), start=1):
        cell.execution_count = number
    about = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    whole = v4.new_notebook(cells=made, metadata=about)
    validate(whole)
    content = f"{writes(whole)}\n".encode()
    if len(content) > MOST_BYTES:
        raise ValueError(f"a notebook of {len(content)} bytes; at most {MOST_BYTES} were wanted")
    return content


def _is_code(block: Block) -> bool:
    return block.runs or "file" in block.words


def _fenced(block: Block):
    from nbformat import v4

    return v4.new_markdown_cell(f"```{block.language}\n{block.code}```")


def _cell(block: Block) -> str:
    """The source of a cell: commands and files are magics of IPython."""
    if "file" in block.words:
        return f"%%writefile {block.words['file']}\n{block.code}".rstrip()
    return (f"%%bash\n{block.code}" if block.language == "sh" else block.code).rstrip()
