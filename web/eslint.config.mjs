import js from "@eslint/js";
import globals from "globals";

// Unused variables are TypeScript's to find (tsconfig.json): ESLint does not see that JSX uses a component.
export default [
  { ignores: ["dist/"] },
  js.configs.recommended,
  { rules: { "no-unused-vars": ["error", { ignoreRestSiblings: true }] } },
  { files: ["src/**"], languageOptions: { globals: globals.browser, parserOptions: { ecmaFeatures: { jsx: true } } }, rules: { "no-unused-vars": "off" } },
  { files: ["*.mjs", "test/**"], languageOptions: { globals: { ...globals.node, ...globals.browser } } },
];
