import pytest

from laserimg.files import atomic_write


def test_a_full_disk_names_the_file_and_leaves_what_was_there(tmp_path):
    path = tmp_path / "state.npz"
    path.write_text("earlier")
    with pytest.raises(OSError, match="No space left") as raised, atomic_write(path) as temporary:
        temporary.write_text("half of the")
        raise OSError(28, "No space left on device")
    assert raised.value.filename == str(path)
    assert path.read_text() == "earlier"
    assert list(tmp_path.iterdir()) == [path]


def test_what_names_its_file_stays_as_it_is(tmp_path):
    with pytest.raises(FileNotFoundError) as raised, atomic_write(tmp_path / "a") as temporary:
        (temporary.parent / "other" / "b").write_text("")
    assert raised.value.filename == str(tmp_path / "other" / "b")
