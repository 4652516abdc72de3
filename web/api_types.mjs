// The types of the service's JSON, from data/openapi.json: src/client/api.d.ts, which build.mjs writes and compares.
import { readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const root = dirname(fileURLToPath(import.meta.url));
export const API_TYPES = join(root, "src", "client", "api.d.ts");
const HEADER = "// Made of data/openapi.json by web/build.mjs: do not edit. docs/service.md tells what the values mean, their frames and units.\n";
const SIMPLE = { string: "string", integer: "number", number: "number", boolean: "boolean", null: "null" };
const KNOWN = ["type", "description", "properties", "required", "items", "prefixItems", "minItems", "maxItems", "enum", "const", "oneOf", "anyOf", "$ref",
  "additionalProperties", "pattern", "contentEncoding", "format", "minimum", "maximum", "exclusiveMinimum", "minLength", "maxLength", "default"];

const inside = (type) => (/[|]/.test(type) ? `(${type})` : type);
const comment = ({ description }) => (description ? `/** ${description} */ ` : "");

/** A JSON schema, of the kinds that the description uses, as a type of TypeScript. Throws an Error for a kind that it does not know. */
export function typeOf(schema) {
  for (const key of Object.keys(schema)) if (!KNOWN.includes(key)) throw new Error(`openapi.json: no type is known for ${key}, in ${JSON.stringify(schema)}`);
  if (schema.$ref) return schema.$ref.replace("#/components/schemas/", "");
  if ("const" in schema) return JSON.stringify(schema.const);
  if (schema.enum) return schema.enum.map((value) => JSON.stringify(value)).join(" | ");
  const choices = schema.oneOf ?? schema.anyOf;
  if (choices) return choices.map((choice) => inside(typeOf(choice))).join(" | ");
  if (schema.type === "array") return listOf(schema);
  if (schema.type === "object") return `{ ${membersOf(schema).join("; ")} }`;
  if (!(schema.type in SIMPLE)) throw new Error(`openapi.json: no type is known for ${JSON.stringify(schema)}`);
  return SIMPLE[schema.type];
}

function listOf({ items, prefixItems, minItems, maxItems }) {
  if (prefixItems) return `[${prefixItems.map(typeOf).join(", ")}]`;
  const each = typeOf(items);
  return minItems !== undefined && minItems === maxItems ? `[${Array(minItems).fill(each).join(", ")}]` : `${inside(each)}[]`;
}

function membersOf({ properties = {}, required = [] }) {
  return Object.entries(properties).map(([name, schema]) => `${comment(schema)}${name}${required.includes(name) ? "" : "?"}: ${typeOf(schema)}`);
}

function declaration(name, schema) {
  const about = schema.description ? `${comment(schema).trim()}\n` : "";
  if (schema.type !== "object") return `${about}export type ${name} = ${typeOf(schema)};`;
  return `${about}export interface ${name} {\n${membersOf(schema).map((member) => `  ${member};\n`).join("")}}`;
}

/** The file's text: each schema as a type of its name, and the answers that have none. */
export function apiTypes() {
  const api = JSON.parse(readFileSync(join(root, "..", "data", "openapi.json"), "utf8"));
  const answer = (path, method, status) => api.paths[path][method].responses[status].content["application/json"].schema;
  const schemas = { ...api.components.schemas, Anchors: answer("/v1/maps/{map}/anchors", "get", "200"), Maps: answer("/v1/maps", "get", "200") };
  return HEADER + Object.entries(schemas).map(([name, schema]) => `\n${declaration(name, schema)}\n`).join("");
}
