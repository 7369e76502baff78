"""Run the notebooks from start to end and keep what they show: ``python scripts/run_notebooks.py [NAME ...]``.

The digest of the code that was run is kept beside the outputs; a test compares it with the code. Needs ``nbclient`` and
``ipykernel`` (``pip install "vinl[dev]"``).
"""

from __future__ import annotations

import hashlib
import json
import re
import sys
import tempfile
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"
TIMEOUT = 900
"""Seconds for a cell."""


def digest_code(notebook: dict[str, Any]) -> str:
    """What changes with any code cell."""
    code = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    return hashlib.sha256("\0".join(code).encode()).hexdigest()[:16]


def run(path: Path) -> None:
    """Run a notebook in an empty folder and write it back with its outputs."""
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        NotebookClient(notebook, timeout=TIMEOUT, resources={"metadata": {"path": folder}}).execute()
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        if cell.cell_type == "code":
            cell.outputs = [output for output in cell.outputs if not _is_progress(output)]
    notebook.metadata = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
        "code": digest_code(notebook),
    }
    text = json.dumps(notebook, indent=1, ensure_ascii=False)
    path.write_text(re.sub(r"/tmp/tmp\w+/", "", text) + "\n", encoding="utf-8")


def _is_progress(output: Any) -> bool:
    """Bars and warnings of this machine."""
    data = output.get("data", {})
    is_widget = "application/vnd.jupyter.widget-view+json" in data
    is_warning = "UserWarning: " in "".join(data.get("text/plain", ""))  # rich prints it among the outputs
    return is_widget or is_warning or (output.output_type == "stream" and output.name == "stderr")


if __name__ == "__main__":
    for name in sys.argv[1:] or sorted(path.stem for path in FOLDER.glob("*.ipynb")):
        run(FOLDER / f"{name}.ipynb")
        print(f"{name}: {(FOLDER / f'{name}.ipynb').stat().st_size / 1e6:.2f} MB", flush=True)
