import type { Scene } from '../view/scene';

const SECONDS = 5;
const SIDE = 720; // px
const TITLE = 112; // px, of the title below

/// Films pendulums side by side for five seconds. Throws the recorder's errors.
export async function record(
  scenes: readonly Scene[],
  title: () => readonly [string, string],
  mimeType: string,
): Promise<Blob> {
  const picture = document.createElement('canvas');
  picture.width = SIDE * scenes.length;
  picture.height = SIDE + TITLE;
  const context = picture.getContext('2d')!;
  const recorder = new MediaRecorder(picture.captureStream(), { mimeType });
  const pieces: Blob[] = [];
  recorder.ondataavailable = ({ data }) => pieces.push(data);
  const stopped = new Promise((resolve) => (recorder.onstop = resolve));
  const end = performance.now() + 1000 * SECONDS;
  const frame = (): void => {
    draw(
      context,
      scenes,
      [...title(), shownAddress()].filter((line) => line !== ''),
    );
    if (performance.now() < end) requestAnimationFrame(frame);
    else recorder.stop();
  };
  recorder.start();
  frame();
  await stopped;
  for (const track of recorder.stream.getTracks()) track.stop();
  return new Blob(pieces, { type: recorder.mimeType });
}

/// Draws the square around each pendulum, and up to three lines below.
function draw(
  context: CanvasRenderingContext2D,
  scenes: readonly Scene[],
  lines: readonly string[],
): void {
  const { canvas } = scenes[0]!;
  const { width, height } = context.canvas;
  context.fillStyle = canvas.color('page');
  context.fillRect(0, 0, width, height);
  scenes.forEach((scene, i) => {
    const { x, y, half } = scene.square;
    const ratio = scene.canvas.element.width / scene.canvas.width;
    const [left, top, side] = [x - half, y - half, 2 * half].map((length) => length * ratio);
    const { element } = scene.canvas;
    context.drawImage(element, left!, top!, side!, side!, i * SIDE, 0, SIDE, SIDE);
  });
  context.textAlign = 'center';
  lines.forEach((line, i) => {
    context.font = canvas.font(i === 0 ? '600 30px' : '24px');
    context.fillStyle = canvas.color(i === 0 ? 'ink' : 'quiet');
    context.fillText(line, width / 2, SIDE + 26 + 34 * i, width - 40);
  });
}

/// The page's address for people.
function shownAddress(): string {
  if (location.protocol === 'file:') return 'Upswing';
  return `${location.host}${location.pathname}`.replace(/\/(index\.html)?$/, '');
}
