// What a joint file wants on the hand: a picture of its marks, drawn from the file itself.
interface Skeleton {
  name: string;
  marks: { kind: 'colour' | 'printed'; names?: string[]; ids?: Record<string, number>; size_mm?: number };
  links?: [string, string, number][]; // from, to, mm
}

const files = import.meta.glob<{ skeletons: Skeleton[] }>('../../../models/joints/*.json', {
  eager: true,
  import: 'default',
});
const skeletonsOf = (joints: string | null): Skeleton[] =>
  Object.entries(files).find(([path]) => path.endsWith(`/${joints}.json`))?.[1].skeletons ?? [];

const kBeside_mm = 44;
const kBranch_rad = 0.7; // a second chain from the same mark leans by so much

interface Mark {
  x: number;
  y: number;
  turn: number;
}

// Fingers straight up, mark by mark as far apart as the bones are long.
function place({ marks, links = [] }: Skeleton, x: number): Map<string, Mark> {
  const names = marks.names ?? Object.keys(marks.ids ?? {});
  const placed = new Map<string, Mark>([[names[0]!, { x, y: 0, turn: 0 }]]);
  const row = names.slice(1).map((name, i): [string, string, number] => [names[i]!, name, 30]);
  const begun = new Set<string>();
  for (const [from, to, length] of links.length > 0 ? links : row) {
    const at = placed.get(from)!;
    const turn = begun.has(from) ? at.turn - kBranch_rad : at.turn;
    begun.add(from);
    placed.set(to, { x: at.x + length * Math.sin(turn), y: at.y - length * Math.cos(turn), turn });
  }
  return placed;
}

function Drawn({ skeleton, marks, x }: { skeleton: Skeleton; marks: Map<string, Mark>; x: number }) {
  return (
    <>
      {(skeleton.links ?? []).map(([from, to]) => {
        const [a, b] = [marks.get(from)!, marks.get(to)!];
        return <line x1={a.x} y1={a.y} x2={b.x} y2={b.y} />;
      })}
      {[...marks.values()].map((at) =>
        skeleton.marks.kind === 'printed' ? (
          <rect x={at.x - 6} y={at.y - 6} width={12} height={12} />
        ) : (
          <circle cx={at.x} cy={at.y} r={4} />
        ),
      )}
      <text x={x} y={16} text-anchor="middle">
        {skeleton.name}
      </text>
    </>
  );
}

export function Marks({ test, joints }: { test: string; joints: string | null }) {
  const skeletons = skeletonsOf(joints);
  if (skeletons.length === 0) return null;
  const placed = skeletons.map((skeleton, i) => place(skeleton, i * kBeside_mm));
  const points = placed.flatMap((marks) => [...marks.values()]);
  const left = Math.min(...points.map(({ x }) => x)) - 20;
  const top = Math.min(...points.map(({ y }) => y)) - 12;
  const width = Math.max(...points.map(({ x }) => x)) + 20 - left;
  const { kind, size_mm, ids } = skeletons[0]!.marks;
  const numbers = Object.values(ids ?? {}).join(', ');
  return (
    <figure class="marks" data-testid={test}>
      <svg role="img" aria-label="Where the marks are" viewBox={`${left} ${top} ${width} ${22 - top}`}>
        {skeletons.map((skeleton, i) => (
          <Drawn key={skeleton.name} skeleton={skeleton} marks={placed[i]!} x={i * kBeside_mm} />
        ))}
      </svg>
      <figcaption>
        {kind === 'printed'
          ? `${points.length} printed marks, ${size_mm} mm: numbers ${numbers} from the palm outwards.`
          : `${points.length} dots of one bright colour that nothing else in the picture has, on palm, joints and tips.`}
      </figcaption>
    </figure>
  );
}
