#pragma once

namespace seastitch {

// report.html as a template of FillTemplate(). Values whose names begin with `has_` are conditions.
constexpr const char* kReportPage = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{{title}}</title><style>
body{font:15px/1.5 "DejaVu Sans",system-ui,sans-serif;color:#21262d;max-width:1240px;margin:2em auto;padding:0 1em}
h1{font-size:1.6em;margin-bottom:.2em}h2{font-size:1.15em;margin-top:2em}
table{border-collapse:collapse;margin:1em 0}th,td{padding:.25em .9em;border-bottom:1px solid #dfe3e8;text-align:left}
th{background:#f3f5f7}td{font-variant-numeric:tabular-nums}
.banner{padding:.8em 1em;border-left:5px solid;background:#f3f5f7;margin:1em 0}
.good{border-color:#2f9e62}.plain{border-color:#7a8794}.part{border-color:#d9911f}.bad{border-color:#c8453c}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(440px,100%),1fr));gap:1em}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(180px,1fr));gap:1em;margin:1em 0}
.tile{background:#f3f5f7;padding:.8em 1em}.tile b{display:block;font-size:1.5em;font-weight:600}
summary{cursor:pointer}details{overflow-x:auto}figure{margin:0}img{width:100%;border:1px solid #dfe3e8}figcaption{font-size:.9em;color:#57606a}
.small{font-size:.9em;color:#57606a}
</style></head><body>
<h1>{{title}}</h1>
<p class="small">{{head}}</p>
<div class="banner {{banner}}">{{statement}}</div>
{{#warnings}}<div class="banner bad">Warnings<ul>
{{warnings}}</ul></div>
{{/warnings}}{{#has_map}}<div class="tiles">
{{tiles}}</div>
{{#has_overlap}}<h2>Swath mismatch</h2>
<div class="pair">
{{#corrected}}<figure><a href="{{mismatch_before}}"><img src="{{mismatch_before}}" alt="As navigated"></a><figcaption>As navigated</figcaption></figure>
{{/corrected}}<figure><a href="{{mismatch}}"><img src="{{mismatch}}" alt="Delivered map"></a><figcaption>Delivered map</figcaption></figure>
</div>
{{/has_overlap}}<h2>Depth</h2>
<div class="pair">
{{#corrected}}<figure><a href="{{depth_before}}"><img src="{{depth_before}}" alt="As navigated"></a><figcaption>As navigated</figcaption></figure>
{{/corrected}}<figure><a href="{{depth}}"><img src="{{depth}}" alt="Delivered map"></a><figcaption>Delivered map</figcaption></figure>
</div>
{{/has_map}}<details{{figures_open}}><summary>All figures</summary>
{{before_after}}{{survey}}{{#has_map}}<p class="small">Both measures have one value [m] per cell with points of two or more submaps: the largest over pairs of
submaps. The swath mismatch, which the pictures show, is the mean distance from the points of one submap to the surface
of the other. It does not depend on the spacing of points. The consistency error is the mean distance to the nearest
points of the other (Roman and Singh, 2006). Before and after are compared over the cells with the same number of submaps in both
maps. Both pictures have the same colour scale.{{#has_truth}} Errors with respect to the truth are horizontal, along the
delivered track. Shape errors are those after the best-fitting rigid motion of the track.{{/has_truth}} Loop closures make
a map consistent. By themselves they do not make its absolute position more accurate.</p>
{{/has_map}}</details>
{{#has_map}}{{#mounting}}<h2>Mounting</h2>
<p class="small">Mounting errors: true value minus the value in vehicle.yaml. All submaps of a dive share them; each dive
has its own. The graph estimates them together with the submaps' poses, and this map is corrected for them. If a value is many sigma from zero, correct
vehicle.yaml and replay:</p>
<ul class="small">
<li>Add the first two to position_m of mbes. A latency (times speed) or a pitch angle (times altitude) also shifts the
soundings forward or back; a patch test distinguishes them.</li>
<li>Subtract the angle from the yaw of mbes. If the DVL is known to have the wrong angle, add it to the yaw of dvl
instead.</li>
<li>An error larger than sonar_mounting_sigma_m is estimated too small, and one several times as large is not estimated at
all. Raise that key then.</li>
</ul>
{{mounting}}{{/mounting}}<h2>Noise</h2>
<p>{{noise_findings}}</p>
{{#noise}}<p class="small">Estimated from the height differences that remain where submaps overlap. The covariance of every loop
closure is computed from these values. A time offset of the sonar is estimated from changes of the measured slope from
ping to ping with the roll rate (or, where the seabed slopes along the track, of the depth with the pitch rate).</p>
{{noise}}{{/noise}}{{#dives}}<h2>Dives</h2>
<ul>
{{dives}}</ul>
{{/dives}}<h2>Loop closures</h2>
{{#has_closure_errors}}<p>With respect to the truth, the normalised squared errors of the {{closures}} accepted closures
add up to {{chi2}}, with {{degrees_of_freedom}} degrees of freedom; the largest is {{worst_chi2}}. With consistent
covariances the first two are about equal, and one closure in a thousand (of rank 3) is above 16.</p>
{{/has_closure_errors}}<details><summary>Every registration</summary>
{{loops}}</details>
{{/has_map}}{{#navigation}}<h2>Navigation</h2>
{{navigation}}{{/navigation}}{{#refused}}<h2>Rejected input</h2>
<details><summary>Counters</summary>
{{refused}}</details>
{{/refused}}{{#mapper}}<h2>Mapper</h2>
<details><summary>Counters</summary>
{{mapper}}</details>
{{/mapper}}<p class="small">Beside this page: {{files}}</p>
</body></html>
)";

}  // namespace seastitch
