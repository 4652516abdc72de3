// node openapi_check.mjs OPENAPI.json < checks.json: prints what is wrong, a line each. A check is {"what", "schema", "value"}: the value must match
// the schema at this JSON pointer, and have no member that it does not name.
import { readFileSync } from "node:fs";
import { Validator } from "@seriousme/openapi-schema-validator";
import Ajv from "ajv/dist/2020.js";

const api = JSON.parse(readFileSync(process.argv[2], "utf8"));
const checks = JSON.parse(readFileSync(0, "utf8"));

const { valid, errors } = await new Validator().validate(structuredClone(api));
if (!valid) console.log(`the description is no OpenAPI: ${JSON.stringify(errors)}`);

function close(schema) {
  if (schema === null || typeof schema !== "object") return;
  if (schema.type === "object" && schema.properties) schema.additionalProperties ??= false;
  Object.values(schema).forEach(close);
}
close(api);
const ajv = new Ajv({ allErrors: true, strict: false, validateFormats: false });
ajv.addSchema(api, "api");
for (const { what, schema, value } of checks) {
  const validate = ajv.getSchema(`api#${schema}`);
  if (!validate) console.log(`${what}: there is no schema at ${schema}`);
  else if (!validate(value)) console.log(`${what}: ${ajv.errorsText(validate.errors)}: ${JSON.stringify(value).slice(0, 300)}`);
}
