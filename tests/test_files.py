import pytest

from laserimg.files import atomic_write, is_hidden, remove_unfinished


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


def test_what_a_killed_writer_left_is_hidden_and_can_be_removed(tmp_path):
    (tmp_path / ".settings").write_text("")
    (tmp_path / "a.xml").write_text("whole")
    with atomic_write(tmp_path / "a.xml") as temporary:
        killed = temporary.with_name(temporary.name + ".xml")
        killed.write_text("half")
    assert is_hidden(killed) and not is_hidden(tmp_path / "a.xml")
    remove_unfinished(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [".settings", "a.xml"]
    remove_unfinished(tmp_path / "missing")


def test_errors_name_the_file_that_was_asked_for(tmp_path):
    (tmp_path / "folder.xml").mkdir()
    with pytest.raises(OSError) as raised, atomic_write(tmp_path / "folder.xml") as temporary:
        temporary.write_text("whole")
    assert raised.value.filename == str(tmp_path / "folder.xml")
    assert [path.name for path in tmp_path.iterdir()] == ["folder.xml"]
