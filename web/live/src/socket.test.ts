import { describe, expect, it } from 'vitest';
import { socketAddress } from './socket';

describe('socketAddress', () => {
  it('lies beside the page, below its token', () => {
    expect(socketAddress('http://127.0.0.1:8080/abc/#look')).toBe('ws://127.0.0.1:8080/abc/socket');
    expect(socketAddress('https://host:1/abc/?x=1')).toBe('wss://host:1/abc/socket');
  });
});
