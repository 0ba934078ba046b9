"""An export takes the place of an earlier one only where that is still as it was written."""

import json
import random
import shutil

import pytest

import dmoc.exports.export as exporting
from dmoc import State, TransferProblem, export
from dmoc.basics.files import json_object, sealed_object

CART = TransferProblem(1.0, State([0], [0]), State([1], [0]), 2.0)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("export") / "out"
    export(CART, folder, steps=4, c=False)
    return folder


@pytest.fixture
def folder(made, tmp_path):
    return shutil.copytree(made, tmp_path / "out")


def refused(folder, *words):
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    with pytest.raises(ValueError, match=r"^cannot export to ") as told:
        export(CART, folder, steps=4, c=False)
    assert all(word in str(told.value) for word in (*words, "name a new folder")), told.value
    assert "\n" not in str(told.value) and len(str(told.value)) < 400
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


def test_a_file_that_was_changed_since_is_not_lost(folder):
    (folder / "README.md").write_text("my notes\n")
    refused(folder, "README.md was changed")


def test_no_flipped_bit_of_the_manifest_goes_unseen(folder):
    """But for one that changes white space alone, which means nothing in JSON."""
    manifest, dice = folder / "manifest.json", random.Random(2)
    whole = manifest.read_bytes()
    seen = 0
    for place in dice.sample(range(len(whole)), 300):
        broken = bytearray(whole)
        broken[place] ^= 1 << dice.randrange(8)
        manifest.write_bytes(broken)
        if json_object(bytes(broken)) != json_object(whole):
            seen += 1
            with pytest.raises(ValueError, match=r"^cannot export to .*; name a new folder"):
                exporting._checked_folder(folder)
    assert seen > 200


@pytest.mark.parametrize("kept", [0.0, 0.3, 0.99])
def test_a_manifest_that_was_cut_short_is_refused(folder, kept):
    whole = (folder / "manifest.json").read_bytes()
    (folder / "manifest.json").write_bytes(whole[: int(kept * len(whole))])
    refused(folder, "manifest.json")


@pytest.mark.parametrize("value", [None, 1, "solver.casadi", [], ["a"], {}, "x" * 5, [[0]]])
@pytest.mark.parametrize("name", ["format", "format_version", "files", "functions"])
def test_other_types_in_a_manifest_are_refused(folder, name, value):
    manifest = json.loads((folder / "manifest.json").read_bytes())
    (folder / "manifest.json").write_text(json.dumps(manifest | {name: value}))
    if name == "format_version" and value == 1:
        # one of the first version had no checksum, but files are looked at all the same
        (folder / "README.md").write_text("my notes\n")
        refused(folder, "README.md")
    else:
        refused(folder, "manifest.json")


@pytest.mark.parametrize("content", ["[" * 100_000, "null", '"dmoc export"', "{}", '{"format": "another"}'])
def test_what_is_no_manifest_is_refused(folder, content):
    (folder / "manifest.json").write_text(content)
    refused(folder, "manifest.json is no manifest")


def test_an_export_of_a_newer_dmoc_is_kept(folder):
    manifest = json.loads((folder / "manifest.json").read_bytes())
    manifest.pop("sha256")
    newer = sealed_object(manifest | {"format_version": exporting.EXPORT_VERSION + 1})
    (folder / "manifest.json").write_text(json.dumps(newer))
    refused(folder, "newer dmoc (format 3, this one reads up to 2)")
