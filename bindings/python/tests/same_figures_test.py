"""The same clip with the same settings gives the same bytes as the command."""
import json
import os
import subprocess

import numpy
import pytest

import oaslam
from conftest import CLIP, FRAMES, mapped


def by_command(folder, *options):
    command = [os.environ["OASLAM_BINARY"], "run", "--images", CLIP / "video.mp4", "--camera", CLIP / "camera.yaml", "--detections", CLIP / "detections.json",
               "--to", str(FRAMES), "--scale", "none", "--out", folder, *options]
    subprocess.run(command, check=True, capture_output=True)
    return (folder / "trajectory.txt").read_bytes()


@pytest.mark.parametrize("mode", [oaslam.RunnerMode.LOCKSTEP, oaslam.RunnerMode.SEQUENTIAL])
def test_trajectory(mode, tmp_path):
    run = mapped(mode)
    oaslam.save_trajectory(tmp_path / "python.txt", run.slam.trajectory())
    assert (tmp_path / "python.txt").read_bytes() == by_command(tmp_path / "run", "--set", f"runner.mode={mode}")
    with open(tmp_path / "run" / "objects.json") as f:
        told = json.load(f)
    assert [thing.id.value for thing in run.slam.snapshot().objects()] == [thing["id"] for thing in told]


def test_an_image_with_gaps_between_its_rows_gives_the_same(desk):
    """Views are read where they are."""
    slam = oaslam.Slam(oaslam.SlamConfig.offline(), desk.camera)
    height, width = desk.images[0].image.shape
    for image in desk.images[:30]:
        wide = numpy.full((height, width + 37), 255, numpy.uint8)
        wide[:, 20:20 + width] = image.image
        view = wide[:, 20:20 + width]
        assert not view.flags.c_contiguous
        last = slam.process(view, image.timestamp)
    again = oaslam.Slam(oaslam.SlamConfig.offline(), desk.camera)
    for image in desk.images[:30]:
        expected = again.process(image.image, image.timestamp)
    assert expected.has_pose
    assert (last.pose_in(last.world) == expected.pose_in(expected.world)).all()


def test_a_trajectory_is_read_as_it_was_written(desk, tmp_path):
    oaslam.save_trajectory(tmp_path / "a.txt", desk.slam.trajectory())
    oaslam.save_trajectory(tmp_path / "b.txt", oaslam.load_trajectory(tmp_path / "a.txt"))
    assert numpy.allclose(numpy.loadtxt(tmp_path / "a.txt"), numpy.loadtxt(tmp_path / "b.txt"), rtol=0, atol=2e-9)
