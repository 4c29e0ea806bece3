"""Renew the translations: ``python resources/translations/update.py [--new CODE]``.

`pyside6-lupdate` collects the sentences of `rhot_app/ui`, the engine's advice, and names that the window shows
into a file for each language, such as `rhot_de.ts`. A translator fills it as text or with Qt Linguist.
`pyside6-lrelease` makes the file that the app loads of it, such as `rhot_de.qm`.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
SOURCES = [HERE.parents[1] / "rhot_app" / name for name in ("ui", "engine")]


def shown_names() -> list[str]:
    """What the window translates of the rest of `rhot_app`: calibrations, what they collect, motions, formats
    of the export, a hand's numbers."""
    from rhot_app.calibration.registry import calibrations
    from rhot_app.export.formats import all_formats
    from rhot_app.hand.anatomy import load_hand
    from rhot_app.handfit.quantities import GROUPS, numbers_of
    from rhot_app.simulator.scene.shipped_motions import shipped_motions

    numbers = numbers_of(load_hand(HERE.parent / "hands" / "right.json"))
    collected = [part for wizard in calibrations() for part in wizard.collect]
    return [*(text for wizard in calibrations() for text in (wizard.title, wizard.meaning)),
            *(text for part in collected for name in ("title", "sentence", "nothing", "simulated")
              if (text := getattr(part, name, ""))),
            *(text for motion in shipped_motions() for text in (motion.name, motion.description)),
            *(one.title for one in all_formats().values()), *GROUPS,
            *sorted({text for number in numbers for text in (number.name, number.meaning)})]


def collect(path: Path) -> None:
    """Bring the sentences of a .ts file up to date; translations stay, those of no sentence go."""
    with tempfile.TemporaryDirectory() as folder:
        records = Path(folder, "records.py")
        records.write_text("".join(f"tr_noop({json.dumps(text, ensure_ascii=False)})\n" for text in shown_names()))
        _run("lupdate", "-silent", "-no-obsolete", "-locations", "none", "-tr-function-alias",
             "QT_TR_NOOP+=tr_noop,QT_TR_NOOP+=words,tr+=advise", "-source-language", "en", "-target-language",
             path.stem.partition("_")[2],
             *(str(source) for folder in SOURCES for source in sorted(folder.rglob("*.py"))), str(records),
             "-ts", str(path))


def release(path: Path, out: Path) -> None:
    """Make the .qm file of a .ts file, of what is translated."""
    _run("lrelease", "-silent", "-nounfinished", str(path), "-qm", str(out))


def _run(tool: str, *arguments: str) -> None:
    subprocess.run([str(Path(sys.executable).with_name(f"pyside6-{tool}")), *arguments], check=True)


def main() -> None:
    """Renew all languages, or begin a new one."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--new", metavar="CODE", help="begin this language, such as fr")
    new = parser.parse_args().new
    for path in [HERE / f"rhot_{new}.ts"] if new else sorted(HERE.glob("rhot_*.ts")):
        collect(path)
        release(path, path.with_suffix(".qm"))


if __name__ == "__main__":
    main()
