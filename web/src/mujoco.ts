import type { MainModule, MjData, MjModel } from '@mujoco/mujoco';
import { ARMATURE, CAPSULE_RADIUS, capsuleInertia, HANGING, mjcf, NOMINAL } from './pendulum';
import type { Plant, State } from './pendulum';
import { isSound, withVelocities } from './simulator';
import type { Push, Simulator } from './simulator';
import { inSi, Units } from './size';

/// The double pendulum in MuJoCo. Only this file uses MuJoCo's interface.
export class Mujoco implements Simulator {
  private readonly mujoco: MainModule;
  private readonly model: MjModel;
  private readonly data: MjData;
  private _plant: Readonly<Plant> = { ...NOMINAL };
  private units = new Units(1);
  private timestep: number; // of the model, s

  constructor(mujoco: MainModule) {
    this.mujoco = mujoco;
    // Compiled once; later plants are written into the model.
    this.model = mujoco.MjModel.from_xml_string(mjcf(NOMINAL))!;
    this.timestep = this.model.opt.timestep;
    this.data = new mujoco.MjData(this.model);
    mujoco.mj_forward(this.model, this.data);
  }

  another(): Mujoco {
    return new Mujoco(this.mujoco);
  }

  get state(): State {
    const { qpos, qvel } = this.data;
    const real = { q1: qpos[0], q2: qpos[1], w1: qvel[0], w2: qvel[1] };
    return withVelocities(real, this.units.time);
  }

  set state(s: State) {
    const { q1, q2, w1, w2 } = withVelocities(s, this.units.velocity);
    this.data.qpos.set([q1, q2]);
    this.data.qvel.set([w1, w2]);
    this.mujoco.mj_forward(this.model, this.data);
  }

  get plant(): Readonly<Plant> {
    return this._plant;
  }

  /// Changes the plant, with the same result as a new MJCF.
  set plant(changed: Readonly<Plant>) {
    const { model, mujoco } = this;
    const state = this.state;
    this._plant = { ...changed };
    this.units = new Units(changed.size);
    const plant = inSi(changed);
    const radius = plant.size * CAPSULE_RADIUS;
    const masses = [plant.mass1, plant.mass2] as const;
    const lengths = [plant.length1, plant.length2] as const;
    for (const link of [0, 1] as const) {
      const [mass, length, body] = [masses[link], lengths[link], link + 1]; // body 0 is the world
      const { across, along } = capsuleInertia(mass, radius, length);
      model.body_mass[body] = mass;
      model.body_inertia.set([across, across, along], 3 * body);
      model.body_ipos[3 * body + 2] = -length / 2;
      model.geom_pos[3 * link + 2] = -length / 2;
      model.geom_size.set([radius, length / 2], 3 * link);
    }
    model.body_pos[3 * 2 + 2] = -plant.length1;
    model.dof_damping.set([plant.damping1, plant.damping2]);
    model.dof_armature.fill(this.units.inertia * ARMATURE);
    model.actuator_ctrlrange.set([-plant.torque_limit, plant.torque_limit]);
    model.opt.gravity.set([0, 0, -plant.gravity]);
    mujoco.mj_setConst(model, this.data); // leaves the pendulum hanging
    this.state = state;
  }

  step(torque: number, push: Push | null, seconds: number): boolean {
    const { data, units } = this;
    const before = data.time;
    const timestep = units.time * seconds;
    if (timestep !== this.timestep) this.model.opt.timestep = this.timestep = timestep;
    data.ctrl[0] = units.torque * torque;
    data.xfrc_applied.fill(0);
    if (push) this.apply(push);
    this.mujoco.mj_step(this.model, data);
    if (data.time > before && isSound(this.state, seconds)) return true;
    this.mujoco.mj_resetData(this.model, data);
    this.state = HANGING;
    return false;
  }

  /// MuJoCo applies forces at a link's centre, so a torque about +y moves the push there.
  private apply({ link, along, force }: Push): void {
    const { units } = this;
    const distance = units.size * along + this.model.body_ipos[3 * link + 2]; // from the centre
    const [x, z] = [units.force * force.x, units.force * force.z];
    const { q1, q2 } = this.state;
    const angle = link === 1 ? q1 : q1 + q2;
    const arm = { x: -Math.sin(angle) * distance, z: -Math.cos(angle) * distance };
    this.data.xfrc_applied.set([x, 0, z], 6 * link);
    this.data.xfrc_applied[6 * link + 4] = arm.z * x - arm.x * z;
  }
}
