// A stand-in for the program: it serves the built page as the program does, speaks apps/live/SOCKET.md and plays a scripted
// glove, hand and calibration. For work on the page and for page_test.mjs; it knows no glove.
// Usage: node live/mock.mjs [--dist FOLDER] [--port N] [--speed N] [--camera page|server]
import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';
import { WebSocketServer } from 'ws';

const here = fileURLToPath(new URL('.', import.meta.url));
const kinds = {
  '.html': 'text/html; charset=utf-8',
  '.js': 'text/javascript',
  '.css': 'text/css',
  '.svg': 'image/svg+xml',
  '.woff2': 'font/woff2',
  '.glb': 'model/gltf-binary',
  '.csv': 'text/csv',
  '.json': 'application/json',
  '.wasm': 'application/wasm',
  '.task': 'application/octet-stream',
};
export const policy =
  "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self' blob:; media-src 'self' blob:; font-src 'self'; worker-src 'self' blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
const fingers = ['thumb', 'index', 'middle', 'ring', 'pinky'];
const steps = ['glove', 'reference', 'motion', 'identify', 'result', 'send'];
const drawnPicture = Buffer.from(
  '/9j/4AAQSkZJRgABAQAAAQABAAD/4gHYSUNDX1BST0ZJTEUAAQEAAAHIAAAAAAQwAABtbnRyUkdCIFhZWiAH4AABAAEAAAAAAABhY3NwAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAQAA9tYAAQAAAADTLQAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA' +
    'AAAAAAAAAAAAAAAAAAAAAAAAAAlkZXNjAAAA8AAAACRyWFlaAAABFAAAABRnWFlaAAABKAAAABRiWFlaAAABPAAAABR3dHB0AAABUAAAABRyVFJDAAABZAAAAChnVFJDAAABZAAAAChiVFJDAAABZAAAAChjcHJ0AAABjAAAADxtbHVjAAAAAAAAAAEAAAAMZW5VUwAA' +
    'AAgAAAAcAHMAUgBHAEJYWVogAAAAAAAAb6IAADj1AAADkFhZWiAAAAAAAABimQAAt4UAABjaWFlaIAAAAAAAACSgAAAPhAAAts9YWVogAAAAAAAA9tYAAQAAAADTLXBhcmEAAAAAAAQAAAACZmYAAPKnAAANWQAAE9AAAApbAAAAAAAAAABtbHVjAAAAAAAAAAEAAAAM' +
    'ZW5VUwAAACAAAAAcAEcAbwBvAGcAbABlACAASQBuAGMALgAgADIAMAAxADb/2wBDABsSFBcUERsXFhceHBsgKEIrKCUlKFE6PTBCYFVlZF9VXVtqeJmBanGQc1tdhbWGkJ6jq62rZ4C8ybqmx5moq6T/2wBDARweHigjKE4rK06kbl1upKSkpKSkpKSkpKSkpKSkpKSk' +
    'pKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKT/wAARCAC0APADASIAAhEBAxEB/8QAGgABAAMBAQEAAAAAAAAAAAAAAAQFBgIDAf/EADUQAAICAAQDBgQFBAMBAAAAAAABAgMEBRFyEjRBEyExM1FxYYHB8CIyQlKRFKGx8RUjJGL/xAAYAQEBAQEBAAAAAAAA' +
    'AAAAAAAAAgEDBP/EACARAQEAAgMBAQEAAwAAAAAAAAABAhEDEiExQRMiI2H/2gAMAwEAAhEDEQA/AKYAGsAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAOoVzsekIuXt0OS0pr7KiuOmmsVJ/HU58mfS' +
    'bXx4d7pWzrnW9JxcX8TkssTFSw89ei1XwK03jz7zZyYdLoABaCKcmlFNt9EdzpsrWsoNL1JWCq0pdun5pcKZIS1emmqfdp6nXHj7Y7csuTrlpVASSUmk9UmDk6gBIwNTstlLTVVx4gy3U28+wt4eLs5aex5lmQsXFK96LTVJtBy4+XvdaeIADsHcKLbI8UK5Neuh8ph2' +
    't0K1+qSRc6KP4UtEu5L0Kxx2rHHspGnFtSTTXRgn5nFcMJ6fi1a9yAZZq6ZZq6AAYx1XXOx6Qi5P4Cyudb0nFxfxRa4ersaILTRyipP46nOMipYaev6e9P0PP/f/AD66dOnm1UAD0OYAAAAA+1wdlkYLxk0jUWYeuyKTX5VomihyqvtMfX6R/E/kaMjKS+VWNs9iqzaM' +
    'MPg1CHjOSTb9F3lMWefWa311/tjr/P8AorCsZJNRmVtu6AHVUHbbCteMpJGsaDA4eKy+qua11XE/n3nzEU1YXD2XLVyjF6avwfQmJJJJeCK7PLOHCxh1nL+y+0ZMr8lbcZ9qjABrAusjpSw9ljX53p8kUpqMHV2OEqr6qPf79TK2OP6Kji10enpr3GexNna4iya8HLu9' +
    'uhocwt7HBWy66aL59xmhE9Zj8gADWpmUV9pj4PpFORezohOXE9U/gVmQ199tntFff8FwZuy+KnihzppXwqj4Qjr839oryRmFna426X/1ovl3Ec1NDqmDtuhWv1SSOSbk9faY6L6QTl9PqBezphNJNaady0K7OFGjCxhHxnLv19F9otSizyzixUa14Qj/AHf2jnMZvel2' +
    '3SuAB0QAAAAALXIa9bLbPRKK+/kXJAyWvgwKl++Tf0+hNnJQhKb8IrVkX6qM5mVnaY619E+H+O4jH2UnKTk/FvVnwtITcnr7THRfSCcvv+SEXGQ16QttfVqKMpFsUWeWcWKjX0hH+7+0Xpl8bZ22Ltn0cnp7GRVeIAKS9sFV22Lqh0ctX7I1BSZFVxXWWvwitF7suyaq' +
    'KrPrdK66l1fEymJmbW9rjp6eEPwr79yGbE0ABo0GT18GBi+s25fT6Eu2arqnN+EYtnyivsqK6/2xSI+bWdngJ+stIoj9UzrbbbfiwAWkLjIa9K7bX1aivv5lOaTLK+ywNS6tcT+ZlbEoy+Ms7bF2z6OT09jRYuzscLbZ1jF6e5lzIUABTAAAAD1wlfa4qqHRyWvsBpML' +
    'X2WGrr6xik/c8c0s7PAWvrJcP8nv29XFw8a1K7PrNKqq/VuX8f7Illvi7LPqmABaA0mWV9lgal1kuJ/MzkI8U4x9XoW1k5Sfi0l3JeheOHdGWfRZYqzscNZZ1jF6e5li0xuIk8A65NtuSWvw8foVZNx63Spl2mwAGNWmCulh8JGMNFKb4myZRjXpLtdHwxctfY8KcLKz' +
    'CUzr0bce9C7Cyrwl1lmifD3JMzxw/wBn9P8AinnJzm5Pxb1Z8ANdw9sDX2uMqh6yTfsu88SwyWCeKlZLuUI+Pxf2wRfFTn1n4aq/VuT+/wCSzjbCb0jJNlDnNnHjpLpBKP1+pMnqqhAApLquDssjBeMmkauKUYqK8EtEZvLl/wCuMv2pss+KXFxcT19Thy8swunTDHb7' +
    'ndnBhFDrOX9l9ooifm9ztsqi/wBMdX7v/RAO2N3Nov0ABrAAACTl6bxD08VFtEYnZNzy2szKbmm43V2kEXM5SdtcZfpgi9/p6uLXs1qUmdc89qOHFx3G7rvy8kzmoggA9DzuqfOhuRorcFGc3JScdfFaGdp86G5GsHa4/DrMvqnziqNOGqjH9z1b69xUl1n3k1bmUo3v' +
    '2mteQAAGly7kadozHkbtoy7kadozHkbtpH6pmgAWkLHLF/0WSXWSTK4uciSlRamtVxI2XXqsbqvSGvGuHx17imxU3PE2yfWb/wAmnjVCD1jFJmWu86e5m5Zdm53bkAEoTcnSljUn4OLLn+kjr+Z6FPkvPLazQHPPDHK+rxtjPZwksa0vBRRCJ2dc89qIJc+IoADQAAAn' +
    'ZLzy2sgk7JeeW1ikaAz+dc89qNAZ/Ouee1ExVQQAUl1T50NyNYZOnzobkawmtirz7yatzKUus+8mrcylNnwoADWNLl3I07RmPI3bRl3I07RmPI3bSP1TNAAtIXWQ+TbuRSl1kPk27kZfjYtDJ3edPczWGTu86e5mQrkAFMTsl55bWaAz+S88trNATVRn86557UQSdnXP' +
    'PaiCVE0AAAAACdkvPLayCTsl55bWKRoDP51zz2o0Bn86557UTFVBABSXVPnQ3I1hk6fOhuRrCa2KvPvJq3MpS6z7yatzKU2fCgANY0uXcjTtGY8jdtGXcjTtGY8jdtI/VM0AC0hdZD5Nu5FKXWQ+TbuRl+Ni0Mnd509zNYZO7zp7mZCuQAUxOyXnltZoDP5Lzy2s0BNV' +
    'GfzrnntRBJ2dc89qIJUTQAAAAAJ2S88trIJOyXnltYpGgM/nXPPai+448XDxLX01KHOuee1ExVQQAUl1T50NyNYZOnzobkaqU4x/NJL3ZlbFbn3k1bmUpc595NW5/wCCmEKAA1jS5dyNO0ZjyN20+ZfJRwFLk0lw9RmElLAXOLTXD0I/VM2AC0hdZD5Nu5FKXOQ+TbuX' +
    '+DK2LUyd3nT3M1alGXg0/ZmUu86e5mQrkAFMTsl55bWaAz+S88trL/ijrpxLX01JyVFBnXPPaiCTs6557UQSomgAAAAAScum4YjVPRuLSIwjJxkpRejXejLNzTZdXa3IOYzc8Rq3q1FJj+unw6cEdfXvI0pOUnKT1b72cOLjywu678vJjnJIAA9Dzuqmo2wb8FJMtLJS' +
    'nOUpeLZUkivFyjHhlFS08GdePKY31z5MblPHtjpt4eEG/CTa/ggnVtsrZcUvkl0OSMru7isZqaoACVLKE3LD1LX8MY6ITm44e1a/hlHRkKm+VS00Uo+jF18rVpoox9EHn/nl37PIAB6AscsnpRZFP9SbK47punTPih80/Bmy6rcbq7XUJOMk14lJa1K2bXg5NnvbjrLI' +
    'OKio6+LRGNysqs8pfgACUJWWz4MVqn3uLSLEpYycZKUXo13pkr/kLOHTgjxep5ubiyzssdMMpJ6+ZlPjxWrfeopMin2UnKTlJ6tvVs+Hok1NOd9oADQAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAB//9k=',
  'base64',
);

// ---- what is simulated

const endsOf = (finger) => (finger === 0 ? [92, 162] : [30, 108]); // open hand and fist, degrees

function angleOf(finger, t_s) {
  const wave = 0.5 - 0.5 * Math.cos((2 * Math.PI * t_s) / (4 + finger * 0.35) - finger * 0.5);
  const shape = wave * wave * (3 - 2 * wave);
  const [open, fist] = endsOf(finger);
  return open + (fist - open) * shape;
}

// Of a calibration's motion: up to which share of it, and what is asked for.
const motion = [
  [0.4, 'Close all fingers slowly, then open them slowly.'],
  [0.7, 'Hold half closed, one second.'],
  [1, 'Open and close fast.'],
  [Infinity, 'Enough. Go on when you are ready.'],
];

const noise = (size) => size * (Math.random() + Math.random() - 1);

class World {
  constructor(options) {
    this.options = options;
    this.start_ms = performance.now();
    this.least = fingers.map(() => Infinity);
    this.most = fingers.map(() => -Infinity);
    this.device = 'boards';
    this.model = {
      name: 'anna-left',
      person: 'anna',
      side: 'left',
      path: '2026-11-24_1530_anna/model.json',
      joints: fingers,
    };
    this.twin = { slip_deg: 0, drift_deg_per_min: 0, noise_counts: 1, loss: 0 };
    this.recording = null;
    this.job = null;
    this.isHeld = false; // no job goes on
    this.last = null;
    this.calibration = null;
    this.anew = { seconds: 0, of_seconds: 10, fingers: [] };
    this.tracking = false;
    this.replay = null;
    this.scores = [{ label: 'raw', total_deg_s: 812.4, gestures_deg_s: [141, 120, 155, 98, 160, 138.4] }];
    this.stands = null; // angles of a hand that does not move
    this.pictures = [];
    this.looked = 0; // pictures that the page looked at itself
    this.done = []; // every word that came
  }

  get now_s() {
    return (performance.now() - this.start_ms) / 1000;
  }

  sample(t_s) {
    const bend = this.stands ?? fingers.map((_, f) => angleOf(f, t_s));
    const sway_deg = this.stands ? 0 : 0.4;
    const angle = bend.map((deg) => (this.model === null ? NaN : deg + this.twin.slip_deg + noise(sway_deg)));
    const raw = bend.map(
      (deg, f) => 180 + 5.4 * (deg - (f === 0 ? 62 : 0)) + noise(2 * this.twin.noise_counts) + 5 * this.twin.slip_deg,
    );
    raw.forEach((value, f) => {
      this.least[f] = Math.min(this.least[f], value);
      this.most[f] = Math.max(this.most[f], value);
    });
    return { raw, angle };
  }

  state() {
    const { raw, angle } = this.sample(this.now_s);
    const quality = ['good', 'good', 'fair', 'poor', 'good'];
    const remark = ['', '', 'not yet fully closed', 'jumps: is the plug loose?', ''];
    const share = Math.min(1, this.now_s / 8);
    const here = !['none', 'gone'].includes(this.device);
    const lost = Math.round(this.twin.loss * 100 * this.now_s);
    return {
      event: 'state',
      device: {
        status: this.device,
        name: here ? 'Flexor glove' : null,
        port: here ? '/dev/pts/3' : null,
        format: here ? 'frames' : null,
        says: here ? 'Both boards answer, 100 frames a second.' : 'Plug in a glove, or connect to a port.',
      },
      next: this.next(),
      fingers: here
        ? fingers.map((name, f) => ({
            name,
            unit: 'counts',
            raw: raw[f],
            angle_deg: Number.isNaN(angle[f]) ? null : angle[f],
            sd_deg: this.model ? 1.4 + 0.3 * f : null,
            open_deg: this.model ? endsOf(f)[0] : null,
            fist_deg: this.model ? endsOf(f)[1] : null,
            least: this.least[f],
            most: this.most[f],
            covered: share * (1 - 0.08 * f),
            quality: this.model ? quality[f] : 'none',
            remark: this.model ? remark[f] : '',
          }))
        : [],
      model: this.model,
      recording: this.recording && {
        file: this.recording.file,
        rows: Math.round((this.now_s - this.recording.from_s) * 100),
        seconds: this.now_s - this.recording.from_s,
      },
      job: this.job && { ...this.job, left_s: Math.max(0, this.job.of_s * (1 - this.job.share)) },
      last: this.last,
      link: { rate_hz: here ? 100 : null, torn: 0, lost, jitter_ms: 0.4, latency_ms: 0.3 },
      calibration: this.calibration && { ...this.calibration },
      tracking: this.tracking,
      tracking_remark: '',
      anew: this.anew,
      twin: ['boards', 'twin'].includes(this.device) ? this.twin : null,
      hand: this.device === 'boards' ? { names: fingers, status: 'simulated', faults: ['', '', '', '', ''] } : null,
      scores: this.scores,
      joint_files: ['green_markers', 'paper_hand', 'printed_finger'],
      replay: this.replay,
      sessions: [
        {
          name: '2026-11-24_1530_anna',
          person: 'anna',
          side: 'left',
          files: ['log.csv', 'model.json', 'markers.csv', 'report/report.html'],
          seconds: 92,
        },
        {
          name: '2026-11-23_0911_ben',
          person: 'ben',
          side: 'right',
          files: ['log.csv', 'reference.csv', 'model.json', 'report/report.html'],
          seconds: 140,
        },
      ],
      models: [
        { path: '2026-11-24_1530_anna/model.json', name: 'anna-left', person: 'anna', side: 'left' },
        { path: '2026-11-23_0911_ben/model.json', name: 'ben-right', person: 'ben', side: 'right' },
      ],
      ports: [
        { path: '/dev/ttyUSB0', name: 'CH340' },
        { path: '/dev/ttyACM0', name: 'Arduino Nano' },
      ],
    };
  }

  next() {
    if (this.device === 'none' || this.device === 'gone') return 'Plug in the glove.';
    if (this.calibration) return `Go on with the calibration: ${this.calibration.say}`;
    if (this.model === null) return 'Choose your model, or calibrate the glove to your hand.';
    return 'Open and close each finger once, all the way.';
  }

  tick(passed_s) {
    const s = passed_s * this.options.speed;
    if (this.job && !this.isHeld) {
      this.job.share += s / this.job.of_s;
      if (this.job.share >= 1) this.job.end();
    }
    if (this.anew.seconds > 0 && this.anew.seconds < 10) {
      this.anew.seconds = Math.min(10, this.anew.seconds + s);
      if (this.anew.seconds === 10)
        this.anew.fingers = fingers.map((name, f) => ({
          name,
          before_deg: 7.1 + f * 0.8,
          after_deg: 1.6 + 0.3 * f,
          verdict: f === 3 ? 'wanted: open and close it once more: 1 of 3 turns of 30 degrees were seen' : 'fitted',
        }));
    }
    if (this.replay?.playing) this.replay.t_s = Math.min(this.replay.of_s, this.replay.t_s + passed_s);
    const c = this.calibration;
    if (c?.step === 'motion') {
      c.seconds = Math.min(c.of_seconds, c.seconds + s);
      const share = c.seconds / c.of_seconds;
      c.covered = fingers.map((name, f) => {
        const at = (rate) => Math.min(1, share * rate * (1 - 0.06 * f));
        const part = { name, range: at(2.2), slow: at(1.5), fast: at(1.15), holds: at(1.3) };
        return {
          ...part,
          missing:
            part.slow < 1
              ? 'close slowly twice more'
              : part.holds < 1
                ? 'hold half closed for a second'
                : part.fast < 1
                  ? 'close fast once more'
                  : '',
        };
      });
      const at = motion.findIndex(([until]) => share < until);
      c.say = motion[at][1];
      c.left_s = share < 1 ? (motion[at][0] - share) * c.of_seconds : null;
      c.then = motion[at + 1]?.[1] ?? null;
      if (c.reference === 'markerless') c.pictures = this.looked;
      else if (c.camera === 'page') c.pictures = this.pictures.length;
      else c.pictures = Math.round(c.seconds * 15);
      c.tracked = 0.97;
    }
  }

  enter(step) {
    const c = this.calibration;
    c.step = step;
    const camera = c.camera === 'none' ? 'Rest the hand, open.' : 'Hold the hand so that the camera sees every mark.';
    c.say = {
      glove: 'Move every finger once, so that each card moves.',
      reference: camera,
      motion: motion[0][1],
      identify: 'The compensator is being fitted. Take your time.',
      result: 'Accept what was found, or repeat the motion.',
      send: 'Send the model into the glove.',
    }[step];
    Object.assign(c, { seconds: 0, left_s: null, then: null });
    c.of_seconds = step === 'motion' ? 60 : null;
    if (step === 'identify') {
      this.job = {
        name: 'identify',
        stage: 'held-out part',
        share: 0,
        of_s: 12,
        end: () => {
          this.end('identify', '2.4 degrees on the held-out part');
          c.result = {
            fingers: fingers.map((name, f) => ({
              name,
              error_deg: 1.8 + 0.4 * f,
              line_deg: 5.4 + 0.7 * f,
              published_deg: 3.1 + 0.5 * f,
              fit_percent: 94 - 1.6 * f,
              verdict: f === 3 ? 'usable: its pole is not certain' : 'good',
            })),
            plot: this.plot('index'),
          };
          this.enter('result');
        },
      };
    }
  }

  plot(finger) {
    const f = fingers.indexOf(finger);
    const t_s = Array.from({ length: 400 }, (_, i) => i * 0.05);
    const reference_deg = t_s.map((t) => angleOf(f, t));
    return {
      t_s,
      finger,
      reference_deg,
      model_deg: reference_deg.map((v) => v + noise(2)),
      line_deg: reference_deg.map((v, i) => angleOf(f, t_s[i] - 0.18) * 0.9 + 8 + noise(2)),
    };
  }

  // null, or the line on what is wrong.
  act(message) {
    this.done.push(message.do);
    const word = this.words[message.do];
    return word ? (word(message) ?? null) : `${message.do}: no such word`;
  }

  words = {
    'device.connect': () => void (this.device = 'boards'),
    'device.leave': () => {
      if (this.replay) this.replay = null;
      else this.device = 'none';
    },
    'model.choose': ({ path }) => {
      const chosen = this.state().models.find((m) => m.path === path);
      if (path !== null && !chosen) return `${path}: no such model. Choose one of the list.`;
      this.model = chosen ? { ...chosen, joints: fingers } : null;
    },
    'record.start': () => void (this.recording = { file: '2026-11-24_1601/log.csv', from_s: this.now_s }),
    'record.stop': () => void (this.recording = null),
    angles: () => void ++this.looked,
    'calibrate.start': ({ person, reference, joints = null }) => {
      if (this.calibration) return 'Another tab calibrates already. Go on there, or cancel it here.';
      if (!person) return 'person: missing. Write a name.';
      const camera = { markerless: 'page', poses: 'none', marks: this.options.camera, drawn: 'server' }[reference];
      this.calibration = { reference, camera, joints, covered: [], pictures: null, tracked: null, result: null };
      this.enter('glove');
    },
    'calibrate.next': () => {
      if (!this.calibration) return 'No calibration runs. Start one.';
      const { step } = this.calibration;
      if (step === 'identify') return 'The fit is not done yet. Wait for it, or stop it.';
      if (step === 'send') this.calibration = null;
      else this.enter(steps[steps.indexOf(step) + 1]);
    },
    'calibrate.back': () => {
      this.job = null;
      this.enter(steps[Math.max(0, steps.indexOf(this.calibration.step) - 1)]);
    },
    'calibrate.cancel': () => void (this.calibration = this.job = null),
    'calibrate.repeat': () => this.enter('motion'),
    'calibrate.accept': () => this.enter('send'),
    'calibrate.plot': ({ finger }) => void (this.calibration.result.plot = this.plot(finger)),
    'anew.start': () => void Object.assign(this.anew, { seconds: 0.01, fingers: [] }),
    'anew.keep': () => void Object.assign(this.anew, { seconds: 0, fingers: [] }),
    'anew.accept': () => void Object.assign(this.anew, { seconds: 0, fingers: [] }),
    'tracking.set': ({ on }) => void (this.tracking = on),
    send: () => this.end('send', 'the glove runs anna-left'),
    flash: () => 'no board answers at this port',
    'twin.set': (message) => {
      for (const [key, value] of Object.entries(message)) if (key in this.twin) this.twin[key] = value;
    },
    'experiment.run': ({ trials }) => {
      const end = () => this.end('experiment', `${trials} trials: 812, 431 and 188 degree seconds`);
      this.job = { name: 'experiment', stage: 'gesture 2 of 6', share: 0, of_s: 10, end };
    },
    'score.run': ({ label }) => {
      const end = () => {
        this.job = null;
        this.scores.push({ label, total_deg_s: 187.5, gestures_deg_s: [31, 28, 36, 22, 38, 32.5] });
      };
      this.job = { name: 'score', stage: 'gesture 1 of 6', share: 0, of_s: 6, end };
    },
    'replay.open': ({ session, file }) =>
      void (this.replay = { file: `${session}/${file}`, t_s: 0, of_s: 92, playing: true }),
    'replay.seek': ({ t_s }) => void (this.replay.t_s = t_s),
    'replay.play': ({ on }) => void (this.replay.playing = on),
    'job.cancel': () => this.end('job', 'stopped', false),
    marker: () => {},
  };

  end(job, text, ok = true) {
    this.job = null;
    this.last = { job, ok, text };
  }
}

function samples(kind, t_s, first, angle) {
  const message = Buffer.alloc(4 + 8 + 8 * first.length);
  message.writeUInt8(kind, 0);
  message.writeUInt8(first.length, 1);
  message.writeUInt16LE(1, 2);
  message.writeDoubleLE(t_s, 4);
  first.forEach((v, i) => message.writeFloatLE(v, 12 + 4 * i));
  angle.forEach((v, i) => message.writeFloatLE(v, 12 + 4 * (first.length + i)));
  return message;
}

function picture(t_s) {
  const head = Buffer.alloc(16);
  head.writeUInt8(4, 0);
  head.writeDoubleLE(t_s, 8);
  return Buffer.concat([head, drawnPicture]);
}

// ---- the server

async function serve(options, request, response) {
  const url = new URL(request.url, 'http://localhost');
  const prefix = `/${options.token}/`;
  if (!url.pathname.startsWith(prefix)) return response.writeHead(403).end();
  const rest = decodeURIComponent(url.pathname.slice(prefix.length)) || 'index.html';
  const headers = {
    'content-security-policy': policy,
    'x-content-type-options': 'nosniff',
    'referrer-policy': 'no-referrer',
    'cache-control': 'no-store',
  };
  if (rest.startsWith('files/'))
    return response.writeHead(200, { ...headers, 'content-type': 'text/csv' }).end('t_s,index\n0,512\n');
  try {
    const file = join(options.dist, normalize(`/${rest}`));
    return response
      .writeHead(200, { ...headers, 'content-type': kinds[extname(file)] ?? 'application/octet-stream' })
      .end(await readFile(file));
  } catch {
    return response.writeHead(404, headers).end();
  }
}

// Resolves to { url, world, drop(), close() }: `drop` ends every socket, as a program that crashed would.
export function startMock(given = {}) {
  const options = { dist: join(here, 'dist'), token: '0123abcd', port: 0, speed: 1, camera: 'page', ...given };
  const world = new World(options);
  const server = createServer((request, response) => void serve(options, request, response));
  const sockets = new WebSocketServer({ server, path: `/${options.token}/socket`, maxPayload: 1 << 20 });
  const all = (data) => {
    for (const client of sockets.clients)
      if (client.readyState === 1 && client.bufferedAmount < 4 << 20) client.send(data);
  };
  sockets.on('connection', (socket) => {
    socket.send(JSON.stringify({ event: 'hello', schema: 1, version: 'mock', demo: options.camera === 'server' }));
    socket.send(JSON.stringify(world.state()));
    socket.on('message', (data, binary) => {
      if (binary) {
        if (data[0] === 3)
          world.pictures.push({
            captured_s: data.readDoubleLE(8),
            bytes: data.length - 16,
            jpeg: data[16] === 0xff && data[17] === 0xd8,
          });
        return;
      }
      const message = JSON.parse(data.toString());
      const error = world.act(message);
      if (message.id !== undefined)
        socket.send(JSON.stringify(error === null ? { id: message.id, ok: true } : { id: message.id, error }));
      if (message.do === 'marker' && error === null)
        all(JSON.stringify({ event: 'marker', host_s: world.now_s, text: message.text }));
      all(JSON.stringify(world.state()));
    });
  });
  const timers = [
    setInterval(() => {
      if (!['none', 'gone'].includes(world.device)) {
        const t_s = world.now_s;
        const { raw, angle } = world.sample(t_s);
        all(samples(1, t_s, raw, angle));
        const duty = fingers.map((_, f) => 20 + noise(5) + f);
        const joint = fingers.map((_, f) => angleOf(f, t_s - 0.12));
        if (world.device === 'boards') all(samples(2, t_s, duty, joint));
      }
    }, 10),
    setInterval(() => all(JSON.stringify(world.state())), 200),
    setInterval(() => world.tick(0.05), 50),
    setInterval(() => {
      if (world.calibration?.camera === 'server' && ['reference', 'motion'].includes(world.calibration.step))
        all(picture(world.now_s));
    }, 200),
  ];
  return new Promise((resolve) => {
    server.listen(options.port, '127.0.0.1', () => {
      resolve({
        url: `http://127.0.0.1:${server.address().port}/${options.token}/`,
        world,
        drop: () => {
          for (const client of sockets.clients) client.terminate();
        },
        close: () =>
          new Promise((done) => {
            timers.forEach(clearInterval);
            for (const client of sockets.clients) client.terminate();
            sockets.close();
            server.closeAllConnections?.();
            server.close(() => done());
          }),
      });
    });
  });
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const given = {};
  for (let i = 2; i + 1 < process.argv.length; i += 2) {
    const name = process.argv[i].slice(2);
    given[name] = name === 'port' || name === 'speed' ? Number(process.argv[i + 1]) : process.argv[i + 1];
  }
  const { url } = await startMock(given);
  console.log(url);
}
