/** The examples of the API page: the same four requests in curl and in Python, with this server's address. */

export interface Example {
  key: "list" | "read" | "write" | "stop";
  curl: string;
  python: string;
}

const TOKEN = '-H "Authorization: Bearer $HORNBILL_TOKEN"';

/** Setup for both, before the first example. */
export function beginning(origin: string): { curl: string; python: string } {
  return {
    curl: `export HORNBILL_URL=${origin}`,
    python: `from hornbill.client import Hornbill\n\nrig = Hornbill("${origin}")`,
  };
}

/** The examples, with the unique ID of a known servo. */
export function examples(uid: string): Example[] {
  const row = `/servos/${uid}/parameters/angle_limit_cw`;
  const curl = (rest: string) => `curl -sS ${rest} \\\n  ${TOKEN}`;
  const at = (path: string) => `"$HORNBILL_URL/api/v1${path}"`;
  const json = " \\\n  -H 'Content-Type: application/json' -d '{\"value\": 60.0}'";
  return [
    {
      key: "list",
      curl: curl(at("/servos")),
      python: "servos = rig.servos()\nprint([one.title for one in servos])",
    },
    {
      key: "read",
      curl: curl(at(row)),
      python: `servo = rig.find(uid="${uid}")\nprint(servo.read("angle_limit_cw"))`,
    },
    {
      key: "write",
      curl: curl(`-X PUT ${at(row)}`) + json,
      python: `servo = rig.find(uid="${uid}")\nservo.write("angle_limit_cw", 60.0)`,
    },
    { key: "stop", curl: curl(`-X POST ${at("/stop")}`), python: "rig.stop()" },
  ];
}
