#!/usr/bin/env bash
# The site has no link that leads nowhere, and start page, a tutorial and a page of the reference are readable in a real browser, as
# phone and desktop, light and dark. Usage: site_test.sh BUILD
set -euo pipefail
cd "$(dirname "$0")/../.."
[ -d web/node_modules ] && command -v sphinx-build >/dev/null || { echo "skipped: script/bootstrap --dev installs what builds and reads the site"; exit 77; }
FLEXOR_BUILD=$1 script/site
cd web && node check_reports.mjs ../out/site/{docs/README,docs/tutorials/maker,reference/commands/identify}.html
