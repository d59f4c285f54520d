import loadMujoco from '@mujoco/mujoco';
import wasmUrl from '@mujoco/mujoco/mujoco.wasm?url';

const mujoco = await loadMujoco({ locateFile: () => wasmUrl });
document.body.append(`MuJoCo ${mujoco.mj_versionString()}`);
