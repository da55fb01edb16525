import { describe, expect, it } from 'vitest';
import { fingerOf, kFingers, poseFromAngles, poseFromPosture, spread } from './mapping';

describe('fingerOf', () => {
  it('reads plain names, joints and aliases', () => {
    expect(fingerOf('index')).toEqual({ finger: 'index', joint: 0 });
    expect(fingerOf('index_pip')).toEqual({ finger: 'index', joint: 1 });
    expect(fingerOf('index_distal')).toEqual({ finger: 'index', joint: 1 });
    expect(fingerOf('index_proximal')).toEqual({ finger: 'index', joint: 0 });
    expect(fingerOf('middle_dip')).toEqual({ finger: 'middle', joint: 2 });
    expect(fingerOf('little')).toEqual({ finger: 'pinky', joint: 0 });
    expect(fingerOf('pointer_mcp')).toEqual({ finger: 'index', joint: 0 });
    expect(fingerOf('thumb')).toEqual({ finger: 'thumb', joint: 1 });
    expect(fingerOf('thumb_ip')).toEqual({ finger: 'thumb', joint: 2 });
  });
  it('knows no other channel', () => {
    expect(fingerOf('wrist')).toBeNull();
    expect(fingerOf('temperature')).toBeNull();
    expect(fingerOf('')).toBeNull();
  });
});

describe('spread', () => {
  it('follows the article’s equations 4 and 5', () => {
    expect(spread('ring', 60)).toEqual([60, 45, 40]);
    expect(spread('thumb', 60)).toEqual([15, 60, 30]);
  });
});

describe('poseFromAngles', () => {
  it('bends a finger at its knuckle and lets the others follow, as estimated', () => {
    const { index } = poseFromAngles(['index'], [80]).fingers;
    expect(index.flex_deg).toEqual([80, 60, 160 / 3]);
    expect(index.sensed).toEqual([true, false, false]);
  });
  it('draws an open hand open, whatever its angles are called', () => {
    expect(poseFromAngles(['thumb', 'index'], [90, 29], [90, 29]).fingers.thumb.flex_deg).toEqual([0, 0, 0]);
    expect(poseFromAngles(['thumb'], [170], [90]).fingers.thumb.flex_deg).toEqual([20, 80, 40]);
    expect(poseFromAngles(['thumb_mcp'], [40], [null]).fingers.thumb.flex_deg).toEqual([10, 40, 20]);
  });
  it('shows two sensed joints of one finger each as it is', () => {
    const { index } = poseFromAngles(['index_proximal', 'index_distal'], [50, 20]).fingers;
    expect(index.flex_deg.slice(0, 2)).toEqual([50, 20]);
    expect(index.sensed).toEqual([true, true, false]);
  });
  it('finds the knuckle where only a joint beyond it is sensed', () => {
    expect(poseFromAngles(['index_pip'], [45]).fingers.index.flex_deg).toEqual([60, 45, 40]);
  });
  it('leaves at rest what is not known, and reports that it is not sensed', () => {
    const { middle } = poseFromAngles(['index', 'middle'], [80, NaN]).fingers;
    expect(middle.sensed).toEqual([false, false, false]);
    expect(middle.flex_deg[0]).toBeLessThan(20);
    for (const finger of kFingers) expect(poseFromAngles([], []).fingers[finger].sensed).toEqual([false, false, false]);
  });
  it('stays within what a hand can do', () => {
    const { index } = poseFromAngles(['index'], [500]).fingers;
    expect(Math.max(...index.flex_deg)).toBeLessThanOrEqual(110);
    expect(poseFromAngles(['index'], [-500]).fingers.index.flex_deg[0]).toBeGreaterThanOrEqual(-35);
  });
});

describe('poseFromPosture', () => {
  const names = 'thumb_rot thumb_mcp thumb_ip thumb_abd index_mcp index_pip index_dip index_abd wrist_pitch'.split(' ');
  it('draws each joint as it comes, and as sensed only what the glove sees', () => {
    const pose = poseFromPosture(names, [-100, 10, 20, 5, 30, 40, 25, -6, 15], ['index', 'thumb']);
    expect(pose.fingers.index).toEqual({ flex_deg: [30, 40, 25], abduct_deg: -6, sensed: [true, false, false] });
    expect(pose.fingers.thumb.flex_deg).toEqual([12, 10, 20]);
    expect(pose.fingers.thumb.sensed).toEqual([false, true, false]);
    expect(pose.wrist_deg).toEqual([15, 0]);
  });
  it('takes what is missing or not known as straight', () => {
    const pose = poseFromPosture(['index_mcp', 'index_pip'], [NaN, 40], []);
    expect(pose.fingers.index.flex_deg).toEqual([0, 40, 0]);
  });
});
