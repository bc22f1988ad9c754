/** Owns the examples of the API page: the same four things in curl and in Python, with this server's address. */

export interface Example {
  key: "list" | "read" | "write" | "stop";
  curl: string;
  python: string;
}

const TOKEN = '-H "Authorization: Bearer $HORNBILL_TOKEN"';

/** What both need once, before the first example. */
export function beginning(origin: string): { curl: string; python: string } {
  return {
    curl: `export HORNBILL_URL=${origin}`,
    python: [
      "import os",
      "import httpx",
      "",
      `url = os.environ.get("HORNBILL_URL", "${origin}")`,
      'token = os.environ.get("HORNBILL_TOKEN")',
      'headers = {"Authorization": f"Bearer {token}"} if token else {}',
      'rig = httpx.Client(base_url=url + "/api/v1", headers=headers)',
    ].join("\n"),
  };
}

/** The examples, with the unique id of a servo that is there. */
export function examples(uid: string): Example[] {
  const row = `/servos/${uid}/parameters/angle_limit_cw`;
  const curl = (rest: string) => `curl -sS ${rest} \\\n  ${TOKEN}`;
  const at = (path: string) => `"$HORNBILL_URL/api/v1${path}"`;
  const json = " \\\n  -H 'Content-Type: application/json' -d '{\"value\": 60.0}'";
  return [
    { key: "list", curl: curl(at("/servos")), python: 'servos = rig.get("/servos").json()' },
    { key: "read", curl: curl(at(row)), python: `row = rig.get("${row}").json()\nprint(row["value"])` },
    {
      key: "write",
      curl: curl(`-X PUT ${at(row)}`) + json,
      python: `rig.put("${row}", json={"value": 60.0}).raise_for_status()`,
    },
    { key: "stop", curl: curl(`-X POST ${at("/stop")}`), python: 'rig.post("/stop").raise_for_status()' },
  ];
}
