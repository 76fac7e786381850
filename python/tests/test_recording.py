import io

import numpy
import polars
import pyarrow.parquet
import pytest

import soleus

TOPICS = ["robot/state", "robot/command", "truth/robot", "sole/deformation", "health/controller", "walk/start"]
# Numbers that CSV holds as floating-point ones: hashes lose their last digits there.
HASHES = ("fingerprint", "hash", "_bits", "_ns")


def test_a_recording_says_what_it_is(recording):
    with soleus.Recording(recording) as opened:
        assert opened.facts["pace"] == "lock-step" and opened.facts["started_utc"]
        assert opened.result["result"]
        assert {"robot/robot.toml", "config/planner.toml"} <= set(opened.files)
        assert len(opened.joints) == 34 and "R_KNEE_P" in opened.joints
        assert opened.topics["truth/robot"] > 500


@pytest.mark.parametrize("topic", TOPICS)
def test_tables_are_those_of_the_csv_file(recording, inspect, topic):
    table = soleus.read(recording, topic)
    csv = polars.read_csv(io.StringIO(inspect("recording", recording, "--csv", topic)), infer_schema=False)
    assert table.columns == ["log_time_s", *csv.columns]
    assert table.height == csv.height > 0
    assert not any(isinstance(kind, (polars.List, polars.Array, polars.Object)) for kind in table.dtypes)
    for name in csv.columns:
        if not name.endswith(HASHES):
            expected = csv[name].replace("inf", "Infinity").cast(polars.Float64, strict=False).to_numpy()
            assert numpy.array_equal(table[name].to_numpy().astype(float), expected, equal_nan=True), name


@pytest.mark.parametrize("topic", [*TOPICS, "sole/contact"])
def test_parquet_holds_the_same_to_the_bit(recording, inspect, tmp_path, topic):
    path = tmp_path / "table.parquet"
    assert inspect("recording", recording, "--parquet", topic, "-o", path).strip() == str(path)
    ours, theirs = soleus.read(recording, topic), polars.read_parquet(path)
    assert theirs.height == ours.height
    for name in ours.columns[1:]:
        assert theirs[name].dtype == ours[name].dtype, name
        assert ours[name].to_numpy().tobytes() == theirs[name].to_numpy().tobytes(), name
    # What is not in ours are places for contact nodes that no message fills.
    left = set(theirs.columns) - set(ours.columns)
    assert all(".node_" in name and not theirs[name].to_numpy().any() for name in left)
    arrow = pyarrow.parquet.read_table(path)
    assert arrow.num_rows == ours.height and arrow.column_names == theirs.columns
    assert pyarrow.parquet.read_metadata(path).metadata[b"pace"] == b"lock-step"


def test_a_window_of_time_is_the_same_rows(recording):
    whole = soleus.read(recording, "truth/robot")
    part = soleus.read(recording, "truth/robot", start_s=1.0, end_s=1.5)
    assert part.equals(whole.filter((whole["log_time_s"] >= 1.0 - 1e-9) & (whole["log_time_s"] < 1.5 - 1e-9)))
    assert part.height == 100


def test_the_walk_can_be_plotted_from_named_columns(recording):
    truth = soleus.read(recording, "truth/robot", frame="pandas")
    weight = truth["foot_wrench_n_nm.left.force_z_n"] + truth["foot_wrench_n_nm.right.force_z_n"]
    assert weight.mean() == pytest.approx(39.0 * 9.81, rel=0.01)
    # The right foot in the air: its force is zero, not left out.
    assert (truth["foot_wrench_n_nm.right.force_z_n"] == 0.0).any()


def test_the_pattern_and_the_log_are_tables_too(recording):
    phases = soleus.read(recording, "walk/pattern")
    assert phases.height > 3 and "feet.left.swing_start_s" in phases.columns
    assert phases["start_s"].is_sorted()
    log = soleus.read(recording, "log")
    assert {"log_time_s", "level", "name", "message"} == set(log.columns)
    assert log.filter(polars.col("message").str.contains("step 1")).height == 1


def test_what_cannot_be_read_says_why(recording, tmp_path):
    with pytest.raises(ValueError, match="robot/state"):
        soleus.read(recording, "robot/stat")
    with pytest.raises(ValueError, match="polars or pandas"):
        soleus.read(recording, "robot/state", frame="R")
    for content in (b"", b"no recording", recording.read_bytes()[:100_000]):
        broken = tmp_path / "broken.mcap"
        broken.write_bytes(content)
        with pytest.raises(soleus.Unreadable, match="--recover"):
            soleus.read(broken, "robot/state")
    with pytest.raises(FileNotFoundError):
        soleus.read(tmp_path / "nothing", "robot/state")
