from benchmarks.robustness.__main__ import main
from reward_model.scenes.socnav2_json import read_socnav2


def test_the_report_has_a_verdict_a_property_and_the_worst_scenes_are_written(tmp_path, capsys):
    assert main(["--scenes", "24", "--output", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert "PASS scored: " in printed
    assert printed.count("FAIL ") + printed.count("PASS ") == 7
    written = sorted(tmp_path.glob("*.json"))
    for file in written:
        assert read_socnav2(file).name.split()[0] == file.stem.split("-")[1]
        assert f"{file.stem.split('-')[0].replace('_', ' ')}, {read_socnav2(file).name}:" in printed.replace("\n", " ")
