"""How files of a stage come to their directory: all at one instant where the system can, else one by one.

At one instant: the stage takes up links to what stays of the directory, and the two are exchanged. One by one where
the directory must remain itself (somebody stands in it, it is mounted, it has folders): a note in the stage says what
was meant, for the next process to finish where this one is killed.
"""

import json
import os
import shutil
import stat
import tempfile
from collections.abc import Collection, Iterable, Sequence
from contextlib import suppress
from pathlib import Path

from jaxsat.errors import InputError
from jaxsat.files.system import exchange, stood_in, sync_directory, sync_files
from jaxsat.files.whole_file import write_whole

_NOTE = ".publish.json"


def publish(stage: Path, real: Path, owned: Sequence[str], *, mode: int) -> None:
    """Moves the staged files to the directory `real` and removes those `owned` that were not staged.

    A directory that is new gets the `mode`. Raises `InputError`, with everything as it was.
    """
    try:
        sync_files(stage)
        if not real.exists():
            stage.chmod(mode)
            stage.rename(real)
            sync_directory(real.parent)
            return
        files = sorted(entry.name for entry in os.scandir(stage))
        replaced = list(dict.fromkeys([*owned, *files]))
        refuse_folders(real, replaced)
        if not _exchanged(stage, real, replaced):
            _move_each(stage, real, files, [name for name in replaced if name not in files])
        sync_directory(real)
    except OSError as error:
        raise InputError(f"cannot write results here: {error.strerror or error}", file=real) from None


def refuse_folders(directory: Path, names: Iterable[str]) -> None:
    """Raises `InputError` for anything but a file or a link under the name of a result: it is the user's."""
    for name in names:
        with suppress(OSError):
            kind = os.lstat(directory / name).st_mode
            if not (stat.S_ISREG(kind) or stat.S_ISLNK(kind)):
                reason = "is a directory" if stat.S_ISDIR(kind) else "is no file"
                reason += ", and the results have a file of this name; move it, or write elsewhere"
                raise InputError(reason, file=directory / name)


def _exchanged(stage: Path, real: Path, replaced: Collection[str]) -> bool:
    """Whether the two were exchanged; where they were not, both are as before."""
    linked: list[Path] = []
    try:
        kept = [entry for entry in os.scandir(real) if entry.name not in replaced]
        own, new = real.stat(), stage.stat()
        if any(entry.is_dir(follow_symlinks=False) for entry in kept) or stood_in(real):
            return False
        if (own.st_uid, own.st_gid, own.st_dev) != (new.st_uid, new.st_gid, new.st_dev):
            return False
        for entry in kept:
            os.link(entry.path, stage / entry.name, follow_symlinks=False)
            linked.append(stage / entry.name)
        shutil.copystat(real, stage)
        os.utime(stage)
        sync_directory(stage)
        exchange(stage, real)
    except OSError:
        for place in linked:
            place.unlink()
        return False
    # What somebody put there in between is theirs.
    for name in [entry.name for entry in os.scandir(stage) if entry.name not in replaced]:
        if not os.path.lexists(real / name):
            (stage / name).rename(real / name)
    sync_directory(real.parent)
    return True


def _move_each(stage: Path, real: Path, files: Sequence[str], dropped: Sequence[str]) -> None:
    """Moves one after the other; on any failure puts back what had been there."""
    note = stage / _NOTE
    text = json.dumps({"files": files, "dropped": dropped})
    write_whole(note, lambda stream: stream.write(text.encode()))
    replaced: list[tuple[Path, Path]] = []
    new: list[Path] = []
    with tempfile.TemporaryDirectory(prefix=".old-", dir=stage) as aside:
        try:
            for name in (*dropped, *files):
                place, kept = real / name, Path(aside) / name
                if os.path.lexists(place):
                    place.rename(kept)
                    replaced.append((kept, place))
                if name in files:
                    (stage / name).rename(place)
                    new.append(place)
        except BaseException:
            note.unlink()
            for place in new:
                place.unlink(missing_ok=True)
            for kept, place in replaced:
                kept.rename(place)
            raise
        note.unlink()


def finish_publishing(stage: Path, real: Path) -> None:
    """Does what is left of the moves of a process that was killed among them."""
    try:
        note = json.loads((stage / _NOTE).read_text("utf-8"))
    except (OSError, ValueError):
        return
    with suppress(OSError):
        for name in note["dropped"]:
            (real / name).unlink(missing_ok=True)
        for name in note["files"]:
            if (stage / name).exists():
                (stage / name).replace(real / name)
        sync_directory(real)
