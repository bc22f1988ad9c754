#!/usr/bin/env bash
# Move a servo with curl and jq: request a lease, turn torque on, move, release the lease.
#   move.sh SERIAL ANGLE
set -euo pipefail
server=${HORNBILL_URL:-http://127.0.0.1:8000}
api=${server%/}/api/v1
serial=$1 angle=$2

# Send a request. A failed one prints the problem and ends the script. HORNBILL_TOKEN is sent if set.
request() {
  local response
  response=$(curl -sS --fail-with-body --max-time 30 ${HORNBILL_TOKEN:+-H "Authorization: Bearer $HORNBILL_TOKEN"} \
    -H 'Content-Type: application/json' "$@") || { echo "$response" | jq -r '"\(.code): \(.detail)"' >&2; return 1; }
  echo "$response"
}

uid=$(request -G "$api/servos" --data-urlencode "serial=$serial" | jq -er '.[0].uid') || { echo "no servo $serial" >&2; exit 1; }
lease=$(request "$api/leases" -d '{"holder": "move.sh", "ttl_s": 30}' | jq -r .id)
trap 'request -X DELETE "$api/leases/$lease" >/dev/null' EXIT   # in every case; turns torque off

request "$api/servos/$uid/torque" -H "Lease: $lease" -d '{"mode": "on"}' >/dev/null
request "$api/servos/$uid/command" -H "Lease: $lease" \
  -d "{\"type\": \"angle\", \"value\": $angle, \"wait\": \"settled\", \"timeout_s\": 5}" |
  jq -r 'if .settled then "at \(.angle_deg)° after \(.settle_time_s) s" else "not there: \(.angle_deg)°\n" | halt_error(1) end'
