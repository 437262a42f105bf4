// Checks node-mavlink: it listens on HOST:PORT, and a vehicle sends to that address.
//
// Usage: node node_client.mjs HOST:PORT, in the folder that node-mavlink is installed in.

import { createRequire } from 'node:module'
import { createSocket } from 'node:dgram'
import { PassThrough } from 'node:stream'
import { pathToFileURL } from 'node:url'

const require = createRequire(pathToFileURL(process.cwd() + '/'))
const { MavLinkPacketSplitter, MavLinkPacketParser, MavLinkProtocolV2, minimal, common } = require('node-mavlink')

const PATIENCE_MS = 30_000
const REGISTRY = { ...minimal.REGISTRY, ...common.REGISTRY }
const socket = createSocket('udp4')
const bytes = new PassThrough()
const packets = bytes.pipe(new MavLinkPacketSplitter()).pipe(new MavLinkPacketParser())
const protocol = new MavLinkProtocolV2(255, 190)
const waiting = []
let vehicle
let sequence = 0

socket.on('message', (datagram, from) => {
  vehicle = from
  bytes.write(datagram)
})
packets.on('data', packet => {
  const clazz = REGISTRY[packet.header.msgid]
  if (!clazz) return
  const data = packet.protocol.data(packet.payload, clazz)
  for (const entry of [...waiting]) {
    if (packet.header.sysid === 1 && entry.clazz === clazz && entry.wanted(data)) {
      waiting.splice(waiting.indexOf(entry), 1)
      entry.resolve(data)
    }
  }
})

function message(clazz, wanted = () => true) {
  return new Promise((resolve, reject) => {
    waiting.push({ clazz, wanted, resolve })
    setTimeout(() => reject(new Error(`no ${clazz.MSG_NAME} within the time limit`)), PATIENCE_MS).unref()
  })
}

function send(data) {
  const packet = protocol.serialize(data, sequence++ & 255)
  socket.send(packet, vehicle.port, vehicle.address)
}

async function command(number, param1) {
  const request = new common.CommandLong()
  request.command = number
  request._param1 = param1
  request.targetSystem = 1
  request.targetComponent = 1
  const answer = message(common.CommandAck, ack => ack.command === number)
  send(request)
  return (await answer).result
}

// A ground station sends heartbeats; without them the vehicle refuses to arm.
function beat() {
  const data = new minimal.Heartbeat()
  data.type = minimal.MavType.GCS
  data.autopilot = minimal.MavAutopilot.INVALID
  data.mavlinkVersion = 3
  if (vehicle) send(data)
}

function check(fact, holds) {
  if (!holds) throw new Error(fact)
  console.log('ok', fact)
}

const [host, port] = process.argv[2].split(':')
socket.bind(Number(port), host, async () => {
  try {
    const first = await message(minimal.Heartbeat)
    setInterval(beat, 500).unref()
    check('the vehicle is a rocket', first.type === minimal.MavType.ROCKET)
    const attitude = await message(common.AttitudeQuaternion)
    // The nose's share of the down axis, whatever its heading.
    check('upright', 2 * (attitude.q1 * attitude.q3 - attitude.q2 * attitude.q4) > 0.99)
    await message(minimal.Heartbeat, data => (data.customMode & 0xFF) === 1)
    check('START before arming is denied', (await command(300, 0)) === 2)
    check('an unknown command is unsupported', (await command(31000, 0)) === 3)
    const list = new common.ParamRequestList()
    list.targetSystem = 1
    list.targetComponent = 1
    const value = message(common.ParamValue)
    send(list)
    check('parameters are REAL32', (await value).paramType === 9)
    await message(common.SysStatus, data => (Number(data.onboardControlSensorsHealth) & 0x10000000) !== 0)
    check('arm is accepted', (await command(400, 1)) === 0)
    await message(minimal.Heartbeat, data => (data.baseMode & 128) !== 0)
    check('HEARTBEAT says armed', true)
    check('termination is accepted', (await command(185, 1)) === 0)
    check('arming is refused afterwards', (await command(400, 1)) !== 0)
    console.log('ALL OK')
    process.exit(0)
  } catch (error) {
    console.error(error.message)
    process.exit(1)
  }
})
