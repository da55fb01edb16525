/// <reference types="vite/client" />

declare const __MARKERLESS__: boolean; // vite.config.ts
