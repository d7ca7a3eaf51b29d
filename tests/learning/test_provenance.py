from pipeline.learning.provenance import made_differently

MADE_WITH = {"robot.merge_m": 0.4, "sensor.beams": 1024, "harvest.map_views": True}


def test_each_difference_is_one_sentence_with_both_values() -> None:
    present = {"sensor.beams": 512, "robot.merge_m": 0.4, "robot.step_m": 0.5, "robot.turn_m": 0.0}
    assert made_differently(MADE_WITH, present) == [
        "The network was made with sensor.beams = 1024; these trials are driven with 512.",
        "The network does not say what it was made with of some settings: these trials are driven with robot.step_m = "
        "0.5, robot.turn_m = 0.0.",
    ]


def test_alike_is_silence_and_what_a_drive_does_not_have_is_not_asked_for() -> None:
    assert made_differently(MADE_WITH, {"sensor.beams": 1024, "robot.merge_m": 0.4}) == []


def test_an_old_file_gives_one_sentence_not_one_for_each_setting() -> None:
    (said,) = made_differently({}, {"sensor.beams": 512, "robot.merge_m": 0.4})
    assert "does not say" in said
