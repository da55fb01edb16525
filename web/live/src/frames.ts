// Drawing happens in animation frames, and only when somebody has something new. The socket's messages are only stored.

type Draw = (now_ms: number) => void;

const draws = new Set<Draw>();
let pending = false;
let oldest_ms = NaN; // arrival of the first message that no frame has shown yet
const latencies: number[] = [];
const kKept = 500;

// Until what it returns is called.
export function onFrame(draw: Draw): () => void {
  draws.add(draw);
  return () => draws.delete(draw);
}

export function wantFrame(): void {
  if (pending) return;
  pending = true;
  requestAnimationFrame((now_ms) => {
    pending = false;
    const arrived_ms = oldest_ms;
    oldest_ms = NaN;
    for (const draw of draws) draw(now_ms);
    if (Number.isNaN(arrived_ms)) return;
    latencies.push(performance.now() - arrived_ms);
    if (latencies.length > kKept) latencies.shift();
  });
}

export function messageArrived(at_ms: number): void {
  if (Number.isNaN(oldest_ms)) oldest_ms = at_ms;
  wantFrame();
}

// From the message to the end of its drawing: the median and the 99th percentile of the last frames, in ms.
export function drawLatency(): { median_ms: number; p99_ms: number; frames: number } {
  const sorted = [...latencies].sort((a, b) => a - b);
  const at = (share: number): number => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] ?? NaN;
  return { median_ms: at(0.5), p99_ms: at(0.99), frames: sorted.length };
}

// A page that is not looked at draws nothing: what it missed says nothing about drawing.
document.addEventListener('visibilitychange', () => {
  oldest_ms = NaN;
  latencies.length = 0;
});
