"""The double pendulum and its task over MuJoCo's Python package, as a Gymnasium environment.

It has the model, observation, reward and episodes of src/pendulum/task.cc and src/pendulum/pendulum_env.cc
with the built-in plant.

Symbols: q1, q2 joint angles (rad; 0 hanging, q2 relative to link 1), w1, w2 their velocities
(rad/s), tau torque at joint 1 (N·m).
"""

from math import cos, sin, sqrt

import gymnasium
import mujoco
import numpy as np

MJCF = """<mujoco model="double_pendulum">
  <option gravity="0 0 -9.81" timestep="0.005" integrator="RK4">
    <flag contact="disable" constraint="disable"/>
  </option>
  <worldbody>
    <body name="link1">
      <joint name="joint1" type="hinge" axis="0 1 0" damping="0.2" armature="0.01"/>
      <geom type="capsule" size="0.04" fromto="0 0 0 0 0 -0.5" mass="1"/>
      <body name="link2" pos="0 0 -0.5">
        <joint name="joint2" type="hinge" axis="0 1 0" damping="0.2" armature="0.01"/>
        <geom type="capsule" size="0.04" fromto="0 0 0 0 0 -0.5" mass="1"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="torque1" joint="joint1" ctrllimited="true" ctrlrange="-5 5"/>
  </actuator>
</mujoco>
"""

TORQUE_LIMIT = 5.0  # N·m
PHYSICS_STEPS = 4  # per control period of 0.02 s
EPISODE_STEPS = 500  # control steps: 10 s
START_NOISE = 0.1  # standard deviation of all four state variables, rad and rad/s

LENGTH, MASS, GRAVITY = 0.5, 1.0, 9.81  # of each link (m, kg); m/s²
ROD_INERTIA = MASS * LENGTH**2 / 12  # kg·m²
ENERGY_TARGET = MASS * GRAVITY * LENGTH / 2 + MASS * GRAVITY * (LENGTH + LENGTH / 2)  # J, upright
MAX_VELOCITY1, MAX_VELOCITY2 = 10.0, 20.0  # rad/s, divisors in the observation
COS_30 = sqrt(3) / 2


def energy(q1, q2, w1, w2):
    """Mechanical energy (J); at rest it is -ENERGY_TARGET hanging and ENERGY_TARGET upright."""
    w12 = w1 + w2
    potential = -MASS * GRAVITY * (1.5 * LENGTH * cos(q1) + LENGTH / 2 * cos(q1 + q2))
    v1_squared = (LENGTH / 2 * w1) ** 2
    v2_squared = LENGTH**2 * (w1**2 + w12**2 / 4 + cos(q2) * w1 * w12)
    return potential + 0.5 * (ROD_INERTIA * (w1**2 + w12**2) + MASS * (v1_squared + v2_squared))


def tip_height(q1, q2):
    """Height of the second link's tip above the pivot (m)."""
    return -LENGTH * (cos(q1) + cos(q1 + q2))


def inverted(q1, q2):
    """Whether both links are within 30° of straight up."""
    return -cos(q1) >= COS_30 and -cos(q1 + q2) >= COS_30


def observe(q1, q2, w1, w2):
    """The eight inputs of the network; energy and height are 0 and -1 hanging, 1 and 1 upright."""
    normalized_energy = (energy(q1, q2, w1, w2) + ENERGY_TARGET) / (2 * ENERGY_TARGET)
    return np.array([cos(q1), sin(q1), w1 / MAX_VELOCITY1, cos(q2), sin(q2), w2 / MAX_VELOCITY2,
                     normalized_energy, tip_height(q1, q2) / (2 * LENGTH)], dtype=np.float32)


def reward(q1, q2, w1, w2, tau):
    """The reward for being in a state under a torque."""
    normalized_energy = (energy(q1, q2, w1, w2) + ENERGY_TARGET) / (2 * ENERGY_TARGET)
    base = min(max(normalized_energy, 0.0), 1.5) + (tip_height(q1, q2) / (2 * LENGTH) + 1) / 2
    if inverted(q1, q2):
        return base + 5 - 0.01 * (w1**2 + w2**2) - 0.05 * tau**2
    return base - 0.01 * tau**2


class DoublePendulum(gymnasium.Env):
    """Starts hanging with noise. The action is a torque (N·m); an episode is truncated after 10 s."""

    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (8,), np.float32)
    action_space = gymnasium.spaces.Box(-TORQUE_LIMIT, TORQUE_LIMIT, (1,), np.float32)

    def __init__(self):
        self.model = mujoco.MjModel.from_xml_string(MJCF)
        self.data = mujoco.MjData(self.model)
        self.steps = 0

    def state(self):
        """The state q1, q2, w1, w2."""
        return (*self.data.qpos.tolist(), *self.data.qvel.tolist())

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        start = START_NOISE * self.np_random.standard_normal(4)
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:], self.data.qvel[:] = start[:2], start[2:]
        self.steps = 0
        return observe(*self.state()), {}

    def step(self, action):
        tau = min(max(float(action[0]), -TORQUE_LIMIT), TORQUE_LIMIT)
        self.data.ctrl[0] = tau
        mujoco.mj_step(self.model, self.data, PHYSICS_STEPS)
        self.steps += 1
        state = self.state()
        return observe(*state), reward(*state, tau), False, self.steps >= EPISODE_STEPS, {}
