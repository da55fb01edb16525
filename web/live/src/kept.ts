// What a person chose on this page, kept by the browser for a year. In cookies, which belong to the machine: the program's port, and
// with it local storage, is another each time.

export function kept(name: string): string | null {
  return document.cookie.match(`(?:^|; )flexor_${name}=([^;]*)`)?.[1] || null;
}

export function keep(name: string, value: string): void {
  document.cookie = `flexor_${name}=${value}; path=/; max-age=31536000; samesite=strict`;
}
