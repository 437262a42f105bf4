"""Sensors with the errors of a day at the field (the defaults of our own simulated sensors), drawn by numpy."""
import math

import numpy as np

G_M_S2 = 9.80665
FRAME_MS, FRAME_S = 5, 0.005


class Sensors:
    """Samples of a motion that is told every millisecond. Body axes: x to the nose, y right, z down; places are north,
    east, up."""

    GYRO_DEG_S_SQRT_HZ, GYRO_BIAS_DEG_S = 0.05, 0.02
    ACCELEROMETER_MG_SQRT_HZ, ACCELEROMETER_BIAS_MG, ACCELEROMETER_SCALE = 0.65, 3.0, 0.001
    BAROMETER_MS, BAROMETER_M, BAROMETER_OFFSET_M, BAROMETER_RAM = 20, 0.08, 0.3, 0.05
    GNSS_MS, GNSS_DELAY_MS, GNSS_M_S = 200, 120, 0.05
    GNSS_WHITE_M, GNSS_WANDER_M = np.array([0.2, 0.2, 0.3]), np.array([1.5, 1.5, 2.5])
    GNSS_CORRELATION_S, GNSS_ZEROED_S = 200.0, 20.0
    LIDAR_MS, LIDAR_M, LIDAR_RANGES_M, LIDAR_TILT_DEG = 10, 0.06, (0.05, 12.0), 45.0

    def __init__(self, seed):
        self.random = np.random.default_rng(seed)
        normal = self.random.standard_normal
        self.gyro_bias = normal(3) * math.radians(self.GYRO_BIAS_DEG_S)
        self.force_bias = normal(3) * self.ACCELEROMETER_BIAS_MG * 1e-3 * G_M_S2
        self.force_scale = 1.0 + normal(3) * self.ACCELEROMETER_SCALE
        self.baro_offset = normal() * self.BAROMETER_OFFSET_M
        self.baro_ram = normal() * self.BAROMETER_RAM
        self.gnss_phase_ms = int(self.random.integers(self.GNSS_MS))
        # The wander of the position since it was zeroed on the pad.
        self.wander = np.zeros(3)
        self.advance_wander(self.GNSS_ZEROED_S)
        self.on_its_way = None
        self.rate_sum, self.force_sum = np.zeros(3), np.zeros(3)
        self.ms = 0

    def advance_wander(self, passed_s):
        spread = math.sqrt(2.0 * passed_s / self.GNSS_CORRELATION_S)
        self.wander = self.wander + self.random.standard_normal(3) * self.GNSS_WANDER_M * spread

    def tell(self, motion):
        """After a millisecond; returns (gyro, force, height, fix, range) after every fifth."""
        self.ms += 1
        self.rate_sum += motion["rate"]
        self.force_sum += motion["force"]
        normal = self.random.standard_normal
        if self.ms % self.GNSS_MS == self.gnss_phase_ms:
            self.advance_wander(self.GNSS_MS * 1e-3)
            place = motion["antenna_place"] + self.wander + normal(3) * self.GNSS_WHITE_M
            velocity = motion["antenna_velocity"] + normal(3) * self.GNSS_M_S
            self.on_its_way = (self.ms + self.GNSS_DELAY_MS, place, velocity, self.ms * 1000)
        if self.ms % FRAME_MS:
            return None
        spread = 1.0 / math.sqrt(FRAME_S)
        gyro = self.rate_sum / FRAME_MS + self.gyro_bias
        gyro = gyro + normal(3) * math.radians(self.GYRO_DEG_S_SQRT_HZ) * spread
        force = self.force_sum / FRAME_MS * self.force_scale + self.force_bias
        force = force + normal(3) * self.ACCELEROMETER_MG_SQRT_HZ * 1e-3 * G_M_S2 * spread
        self.rate_sum, self.force_sum = np.zeros(3), np.zeros(3)
        height = fix = None
        if self.ms % self.BAROMETER_MS == 0:
            ram_m = self.baro_ram * motion["airspeed"] ** 2 / (2.0 * G_M_S2)
            height = motion["barometer_height"] + self.baro_offset - ram_m + normal() * self.BAROMETER_M
        if self.on_its_way and self.on_its_way[0] <= self.ms:
            fix, self.on_its_way = self.on_its_way[1:], None
        distance = self.lidar(motion) if self.ms % self.LIDAR_MS == 0 else None
        return gyro, force, height, fix, distance

    def lidar(self, motion):
        noise = self.random.standard_normal() * self.LIDAR_M
        tilt = motion["tilt"]
        if tilt > math.radians(self.LIDAR_TILT_DEG):
            return None
        distance = motion["place"][2] / math.cos(tilt) - motion["lidar_behind_cg"] + noise
        nearest, farthest = self.LIDAR_RANGES_M
        return distance if nearest <= distance <= farthest * math.sqrt(math.cos(tilt)) else None
