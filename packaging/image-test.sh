#!/usr/bin/env bash
# packaging/image-test.sh: takes the image of out/image into an empty storage and calibrates a pass in a container of it, without a network, the
# directory of the user mounted as docs/install.md says.
set -euo pipefail
cd "$(dirname "$0")/.."
images=(out/image/trihedron-*.oci.tar)
[ -e "${images[0]}" ] || { echo 'image-test: there is no image in out/image; run make image' >&2; exit 2; }
version=$(basename "${images[0]}" .oci.tar)
version=${version#trihedron-}
test=$PWD/out/image/test
buildah=(buildah --root "$test/storage" --runroot "$test/run" --storage-driver vfs)

rm -rf "$test"
mkdir -p "$test/data"
container=$("${buildah[@]}" from --pull=false "oci-archive:${images[0]}")
[ "$("${buildah[@]}" inspect --format '{{index .OCIv1.Config.Labels "org.opencontainers.image.version"}}' "$container")" = "$version" ]
[ "$("${buildah[@]}" inspect --format '{{.OCIv1.Config.Entrypoint}} {{.OCIv1.Config.WorkingDir}}' "$container")" = '[/usr/bin/trihedron] /data' ]

# `buildah run` does not use the entrypoint. Isolation by chroot also works within a container; it has the network of its caller, which here has none.
trihedron() {
  unshare --net "${buildah[@]}" run --isolation chroot --volume "$test/data:/data" "$container" -- /usr/bin/trihedron "$@"
}
[ "$(trihedron --version)" = "$version" ]
printf '[scenario]\nseed = 1\nduration = "270min"\n' > "$test/data/scenario.toml"
trihedron --quiet simulate scenario.toml -o pass.nc
trihedron --quiet calibrate pass.nc -o out
grep -q Plotly "$test/data/out/report.html"
"${buildah[@]}" rm "$container" > /dev/null
rm -rf "$test"
echo 'image-test: passed'
