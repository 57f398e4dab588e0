import { defineConfig } from 'vitest/config';

// No test fails because a machine is slow: the limit only ends what hangs.
export default defineConfig({
  test: { include: ['test/unit/**/*.test.ts'], testTimeout: 120_000 },
});
