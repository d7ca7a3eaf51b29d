"""Settings as frozen records that refuse impossible values, and those of the robot, which every system shares."""

from dataclasses import dataclass, field

from pipeline.errors import ConfigError


def require(holds: bool, key: str, value: object, expected: str) -> None:
    """Raise a ConfigError that names ``key``, its value and what was expected, unless ``holds``."""
    if not holds:
        group = key.partition(".")[0]
        raise ConfigError(f"{key} = {value}: expected {expected}. Change it in conf/{group}/ or by {key}=...")


MOTIONS = ("walk", "car")


@dataclass(frozen=True, kw_only=True)
class SensorConfig:
    """A planar lidar that looks all around, or about its heading (conf/sensor/)."""

    beams: int = 1024
    """Rays cast for each scan."""
    input_beams: int = 256
    """Ranges handed to the network, 64 to 1024: a multiple of 8 that divides ``beams``. Weights are for one number."""
    max_range_m: float
    noise_m: float = 0.0
    """Standard deviation of one range [m]."""
    field_of_view_deg: float = 360.0
    """What it sees at once, the heading in the middle; 360 is all around."""
    layers: list[str] = field(default_factory=list)
    """Layers of the world, such as rooms or doors, whose values it reads wherever a ray passes."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        require(
            64 <= self.input_beams <= 1024 and self.input_beams % 8 == 0,
            "sensor.input_beams",
            self.input_beams,
            "64 to 1024, a multiple of 8 (headings are multiples of 45 degrees)",
        )
        require(
            self.beams >= self.input_beams and self.beams % self.input_beams == 0,
            "sensor.beams",
            self.beams,
            f"a multiple of sensor.input_beams = {self.input_beams}",
        )
        require(0 < self.max_range_m < 1000, "sensor.max_range_m", self.max_range_m, "between 0 and 1000 m")
        require(0 <= self.noise_m < self.max_range_m, "sensor.noise_m", self.noise_m, "at least 0, below max_range_m")
        view = self.field_of_view_deg
        require(10 <= view <= 360, "sensor.field_of_view_deg", view, "from 10 to 360 degrees")


@dataclass(frozen=True, kw_only=True)
class RobotConfig:
    """A disc that moves a fixed length between two observations (conf/robot/)."""

    radius_m: float
    step_m: float
    merge_m: float = 0.0
    """Frontiers less than this apart, by way of reached space, make one subgoal [m]."""
    motion: str = "walk"
    """walk: from cell to cell, 8-connected, turning freely; car: arcs of constant curvature."""
    turn_m: float = 0.0
    """walk: cost of turning once round on the spot, to look [m]; turns along the way cost nothing."""
    turning_radius_m: float = 0.6
    """car: of its tightest arc [m]."""
    primitives: int = 65
    """car: arcs to choose from, from full left to full right."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        require(0 <= self.radius_m < 10, "robot.radius_m", self.radius_m, "from 0 up to 10 m")
        require(0 < self.step_m < 100, "robot.step_m", self.step_m, "between 0 and 100 m")
        require(0 <= self.merge_m < 100, "robot.merge_m", self.merge_m, "from 0 up to 100 m")
        require(self.motion in MOTIONS, "robot.motion", self.motion, f"one of {', '.join(MOTIONS)}")
        require(0 <= self.turn_m < 100, "robot.turn_m", self.turn_m, "from 0 up to 100 m")
        radius, arcs = self.turning_radius_m, self.primitives
        require(0.05 <= radius < 100, "robot.turning_radius_m", radius, "from 0.05 up to 100 m")
        require(3 <= arcs <= 1001 and arcs % 2 == 1, "robot.primitives", arcs, "an odd number, 3 to 1001")
