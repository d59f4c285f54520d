import type { MainModule, MjData, MjModel } from '@mujoco/mujoco';
import { CAPSULE_RADIUS, capsuleInertia, HANGING, mjcf, NOMINAL } from './pendulum';
import type { Plant, State } from './pendulum';
import { isSound } from './simulator';
import type { Push, Simulator } from './simulator';

/// The double pendulum in MuJoCo. Only this file uses MuJoCo's interface.
export class Mujoco implements Simulator {
  private readonly mujoco: MainModule;
  private readonly model: MjModel;
  private readonly data: MjData;
  private _plant: Readonly<Plant> = { ...NOMINAL };

  constructor(mujoco: MainModule) {
    this.mujoco = mujoco;
    // Compiled once; later plants are written into the model.
    this.model = mujoco.MjModel.from_xml_string(mjcf(NOMINAL))!;
    this.data = new mujoco.MjData(this.model);
    mujoco.mj_forward(this.model, this.data);
  }

  another(): Mujoco {
    return new Mujoco(this.mujoco);
  }

  get state(): State {
    const { qpos, qvel } = this.data;
    return { q1: qpos[0], q2: qpos[1], w1: qvel[0], w2: qvel[1] };
  }

  set state(s: State) {
    this.data.qpos.set([s.q1, s.q2]);
    this.data.qvel.set([s.w1, s.w2]);
    this.mujoco.mj_forward(this.model, this.data);
  }

  get plant(): Readonly<Plant> {
    return this._plant;
  }

  /// Changes the plant, with the same result as a new MJCF.
  set plant(plant: Readonly<Plant>) {
    this._plant = { ...plant };
    const { model, mujoco } = this;
    const state = this.state;
    const masses = [plant.mass1, plant.mass2] as const;
    const lengths = [plant.length1, plant.length2] as const;
    for (const link of [0, 1] as const) {
      const [mass, length, body] = [masses[link], lengths[link], link + 1]; // body 0 is the world
      const { across, along } = capsuleInertia(mass, CAPSULE_RADIUS, length);
      model.body_mass[body] = mass;
      model.body_inertia.set([across, across, along], 3 * body);
      model.body_ipos[3 * body + 2] = -length / 2;
      model.geom_pos[3 * link + 2] = -length / 2;
      model.geom_size[3 * link + 1] = length / 2;
    }
    model.body_pos[3 * 2 + 2] = -plant.length1;
    model.dof_damping.set([plant.damping1, plant.damping2]);
    model.actuator_ctrlrange.set([-plant.torque_limit, plant.torque_limit]);
    model.opt.gravity.set([0, 0, -plant.gravity]);
    mujoco.mj_setConst(model, this.data); // leaves the pendulum hanging
    this.state = state;
  }

  step(torque: number, push: Push | null): boolean {
    const { data } = this;
    const before = data.time;
    data.ctrl[0] = torque;
    data.xfrc_applied.fill(0);
    if (push) this.apply(push);
    this.mujoco.mj_step(this.model, data);
    if (data.time > before && isSound(this.state)) return true;
    this.mujoco.mj_resetData(this.model, data);
    this.state = HANGING;
    return false;
  }

  /// MuJoCo applies forces at a link's centre, so a torque about +y moves the push there.
  private apply({ link, along, force }: Push): void {
    const centre = -this.model.body_ipos[3 * link + 2];
    const { q1, q2 } = this.state;
    const angle = link === 1 ? q1 : q1 + q2;
    const arm = { x: -Math.sin(angle) * (along - centre), z: -Math.cos(angle) * (along - centre) };
    this.data.xfrc_applied.set([force.x, 0, force.z], 6 * link);
    this.data.xfrc_applied[6 * link + 4] = arm.z * force.x - arm.x * force.z;
  }
}
