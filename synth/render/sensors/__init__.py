"""Models of depth sensors: a clean depth image in, what a real camera would have measured out."""

from synth.render.sensors.models import RANDOM, SENSOR_NAMES, Ideal, SensorModel, apply_sensor, sensor

__all__ = ["RANDOM", "SENSOR_NAMES", "Ideal", "SensorModel", "apply_sensor", "sensor"]
