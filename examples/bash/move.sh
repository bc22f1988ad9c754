#!/usr/bin/env bash
# Moves a servo with curl and jq alone: motion control, torque on, go there, give motion control back.
#   move.sh SERIAL ANGLE
set -euo pipefail
server=${HORNBILL_URL:-http://127.0.0.1:8000}
api=${server%/}/api/v1
serial=$1 angle=$2

# A function, so that each request fails the script with what the server says, and a token goes along if there is one.
ask() {
  local answer
  answer=$(curl -sS --fail-with-body --max-time 30 ${HORNBILL_TOKEN:+-H "Authorization: Bearer $HORNBILL_TOKEN"} \
    -H 'Content-Type: application/json' "$@") || { echo "$answer" | jq -r '"\(.code): \(.detail)"' >&2; return 1; }
  echo "$answer"
}

uid=$(ask -G "$api/servos" --data-urlencode "serial=$serial" | jq -er '.[0].uid') || { echo "no servo $serial" >&2; exit 1; }
lease=$(ask "$api/leases" -d '{"holder": "move.sh", "ttl_s": 30}' | jq -r .id)
trap 'ask -X DELETE "$api/leases/$lease" >/dev/null' EXIT   # whatever happens; torque goes off then

ask "$api/servos/$uid/torque" -H "Lease: $lease" -d '{"mode": "on"}' >/dev/null
ask "$api/servos/$uid/command" -H "Lease: $lease" \
  -d "{\"type\": \"angle\", \"value\": $angle, \"wait\": \"settled\", \"timeout_s\": 5}" |
  jq -r 'if .settled then "at \(.angle_deg)° after \(.settle_time_s) s" else "not there: \(.angle_deg)°\n" | halt_error(1) end'
